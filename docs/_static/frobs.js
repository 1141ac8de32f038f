"use strict";

/* Let the keyboard scroll what is wider than the page, and hide that long signatures are set as definition lists. */
function describeScrolling() {
  for (const box of document.querySelectorAll(".table-wrapper, figure.wide, pre")) {
    if (box.scrollWidth > box.clientWidth) {
      box.tabIndex = 0;
    } else {
      box.removeAttribute("tabindex");
    }
  }
}

/* Open the static page of a policy below the buttons, in the place of the one that is open. */
function openPage(button) {
  const box = button.parentElement;
  box.querySelector("iframe")?.remove();
  const frame = document.createElement("iframe");
  frame.src = button.dataset.page;
  frame.title = button.textContent;
  box.append(frame);
  for (const each of box.querySelectorAll("button")) {
    each.setAttribute("aria-pressed", String(each === button));
  }
}

addEventListener("DOMContentLoaded", () => {
  for (const button of document.querySelectorAll("[data-page]")) {
    button.addEventListener("click", () => openPage(button));
  }
  for (const part of document.querySelectorAll(".sig dl, .sig dl > dd")) {
    part.setAttribute("role", "presentation");
  }
  describeScrolling();
});
addEventListener("load", describeScrolling);
addEventListener("resize", describeScrolling);
