// Sends the pressed keys and the state of the first gamepad to the server, which answers with the keys that it wants.
(() => {
  const REPEAT = 200, PING = 1000; // [ms]
  const pressed = new Set();
  let socket = null, wanted = new Set(), sent = "", time = 0;

  const isTyping = (target) =>
    target instanceof Element && target.closest("input:not([type=checkbox]):not([type=radio]), textarea, [contenteditable=true]");

  const isHeld = () => !document.hidden && document.hasFocus();

  function state() {
    let axes = [], buttons = [];
    const pad = wanted.size && isHeld() ? [...navigator.getGamepads()].find((each) => each && each.connected) : null;
    if (pad) {
      axes = [...pad.axes].slice(0, 4).map((each) => Math.round(each * 100) / 100);
      buttons = pad.buttons.flatMap((button, i) => (button.pressed ? [i] : []));
    }
    return { keys: [...pressed].sort(), axes, buttons };
  }

  function send() {
    if (!socket || socket.readyState !== WebSocket.OPEN) return;
    if (!isHeld()) pressed.clear();
    const now = performance.now(), current = state(), text = JSON.stringify(current);
    const isActive = current.keys.length || current.buttons.length || current.axes.some((each) => Math.abs(each) > 0.1);
    if (text === sent && now - time < (isActive ? REPEAT : PING)) return;
    [sent, time] = [text, now];
    socket.send(text);
  }

  function onKey(event, isDown) {
    if (isDown && (!wanted.has(event.code) || isTyping(event.target) || event.ctrlKey || event.altKey || event.metaKey)) return;
    if (!isDown && !pressed.has(event.code)) return;
    if (isDown) pressed.add(event.code);
    else pressed.delete(event.code);
    event.preventDefault(); // the key moves the robot, not the camera or a button
    event.stopImmediatePropagation();
    send();
  }

  function release() {
    pressed.clear();
    send();
  }

  function connect() {
    socket = new WebSocket(`ws://${location.host}${location.pathname.replace(/\/?$/, "/")}input`);
    socket.onopen = () => { sent = ""; send(); };
    socket.onmessage = (event) => { wanted = new Set(JSON.parse(event.data)); };
    socket.onclose = () => {
      pressed.clear();
      wanted.clear();
      setTimeout(connect, 2000);
    };
  }

  window.addEventListener("keydown", (event) => onKey(event, true), true);
  window.addEventListener("keyup", (event) => onKey(event, false), true);
  window.addEventListener("blur", release);
  document.addEventListener("visibilitychange", release);
  setInterval(send, 40);
  connect();
})();
