// A click whose connection breaks is shown as such: the page names the button, and the visitor presses it again.
// Without a connection nothing is kept for later: the machine may be in another state by then.
"use strict";
(() => {
  const KEPT = "bench-lost-click"; // in the session: the page reloads where its process has restarted
  const CONTROLS = ".q-btn, .q-toggle, .q-field, .q-checkbox, .q-item";
  const waiting = new Map(); // text of the control by number, until the page's process has taken the event
  let number = 0;
  let leaving = false;

  function show() {
    const banner = document.getElementById("bench-lost-click");
    const lost = JSON.parse(sessionStorage.getItem(KEPT) || "null");
    if (!banner) return;
    banner.hidden = lost === null;
    banner.textContent = lost ? banner.dataset[lost.kind].replace("{control}", lost.control) : "";
  }
  function keep(kind, control) {
    sessionStorage.setItem(KEPT, JSON.stringify({ kind, control }));
    show();
  }
  function taken() {
    sessionStorage.removeItem(KEPT);
    show();
  }

  // what a visitor presses, as its text or its name; "" for charts, jogs (they end by themselves) and the like
  function controlOf(message) {
    const element = document.getElementById(`c${message.id}`);
    const control = element?.closest("[data-jog]") ? null : element?.closest(CONTROLS);
    if (!control) return "";
    const label = control.querySelector(".q-btn__content .block, .q-field__label")?.textContent;
    return (label || control.getAttribute("aria-label") || control.textContent || "?").trim().slice(0, 60);
  }

  function watch(socket) {
    const emit = socket.emit;
    socket.emit = (name, message, ...rest) => {
      const control = name === "event" ? controlOf(message) : "";
      if (!control) return emit.call(socket, name, message, ...rest);
      if (!socket.connected) {
        keep("unsent", control);
        return socket;
      }
      const mine = ++number;
      waiting.set(mine, control);
      return emit.call(socket, name, message, () => waiting.delete(mine) && taken());
    };
    socket.on("disconnect", () => {
      const last = [...waiting.values()].pop();
      waiting.clear();
      if (last !== undefined && !leaving) keep("unanswered", last);
    });
  }
  window.addEventListener("pagehide", () => {
    leaving = true;
  });
  document.addEventListener("DOMContentLoaded", show);
  Object.defineProperty(window, "socket", {
    configurable: true,
    set(socket) {
      Object.defineProperty(window, "socket", { value: socket, writable: true });
      watch(socket);
      show(); // the page is built
    },
  });
})();
