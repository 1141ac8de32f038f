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

addEventListener("DOMContentLoaded", () => {
  for (const part of document.querySelectorAll(".sig dl, .sig dl > dd")) {
    part.setAttribute("role", "presentation");
  }
  describeScrolling();
});
addEventListener("load", describeScrolling);
addEventListener("resize", describeScrolling);
