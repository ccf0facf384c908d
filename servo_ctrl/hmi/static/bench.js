// What has to work in the browser itself: STOP, holding a jog button, seeing that the page has gone
// stale, and plots that are not displayed.
"use strict";
(() => {
  const RENEW_MS = 100; // the machine lets a jog go on for 250 ms
  const STALE_MS = 2000;
  const STOP_ANSWER_MS = 2000;

  // ---- STOP: a request of its own, so that it does not depend on the page's websocket
  async function stop() {
    dropJog();
    const button = document.getElementById("bench-stop");
    button?.classList.add("sent");
    let failed = "";
    try {
      const answer = await fetch("/stop", {
        method: "POST",
        keepalive: true,
        signal: AbortSignal.timeout(STOP_ANSWER_MS),
      });
      if (answer.status !== 200) failed = `the page answered ${answer.status}`;
      else {
        const verdict = await answer.json();
        if (!verdict.accepted) failed = verdict.reason || "refused";
      }
    } catch (error) {
      failed = "no answer";
    }
    setTimeout(() => button?.classList.remove("sent"), 400);
    const banner = document.getElementById("bench-stop-failed");
    if (banner) {
      banner.hidden = failed === "";
      banner.textContent = failed && `STOP did not reach the machine (${failed}). Use the emergency stop.`;
    }
  }
  document.addEventListener(
    "pointerdown",
    (event) => {
      if (event.target.closest?.("#bench-stop")) {
        event.preventDefault();
        stop();
      }
    },
    true,
  );
  document.addEventListener(
    "click",
    (event) => {
      // by Enter or Space on the focused button, or by an assistive tool; a pointer has had its turn
      if (event.target.closest?.("#bench-stop") && event.detail === 0) stop();
    },
    true,
  );
  window.addEventListener(
    "keydown",
    (event) => {
      if (event.key === "Escape" && !event.repeat) stop();
    },
    true,
  );

  // ---- jogging: as long as a button or an arrow key is held, and no longer
  let held = null; // {element, key, timer}
  function renew() {
    if (held && !document.body.classList.contains("bench-stale")) {
      held.element.dispatchEvent(new CustomEvent("jog-renew"));
    } else dropJog();
  }
  function holdJog(element, key) {
    if (held?.element === element) return;
    dropJog();
    if (element.disabled || element.getAttribute("aria-disabled") === "true") return;
    held = { element, key, timer: setInterval(renew, RENEW_MS) };
    element.classList.add("held");
    renew();
  }
  function dropJog() {
    if (!held) return;
    const { element, timer } = held;
    held = null;
    clearInterval(timer);
    element.classList.remove("held");
    element.dispatchEvent(new CustomEvent("jog-drop"));
  }
  document.addEventListener("pointerdown", (event) => {
    const element = event.target.closest?.("[data-jog]");
    if (element && event.button === 0) {
      event.preventDefault();
      holdJog(element, null);
    }
  });
  for (const name of ["pointerup", "pointercancel"]) {
    window.addEventListener(name, () => held && held.key === null && dropJog(), true);
  }
  document.addEventListener("pointermove", (event) => {
    // a finger that slides off the button has let go of it
    if (!held || held.key !== null) return;
    const under = document.elementFromPoint(event.clientX, event.clientY);
    if (!under || !held.element.contains(under)) dropJog();
  });
  document.addEventListener("contextmenu", (event) => event.target.closest?.("[data-jog]") && event.preventDefault());
  window.addEventListener("blur", dropJog);
  window.addEventListener("pagehide", dropJog);
  document.addEventListener("visibilitychange", () => document.hidden && dropJog());
  document.addEventListener("focusin", (event) => held && held.key !== null && isInput(event.target) && dropJog());

  const isInput = (element) =>
    element?.closest?.("input, textarea, select, [contenteditable=true], [role=listbox], [role=slider], [role=tree]");
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || isInput(document.activeElement)) return;
    const focused = document.activeElement?.closest?.("[data-jog]");
    const byFocus = focused && (event.key === " " || event.key === "Enter");
    const element = byFocus ? focused : document.querySelector(`[data-jog-key="${CSS.escape(event.key)}"]`);
    if (!element) return;
    event.preventDefault();
    if (!event.repeat) holdJog(element, event.key);
  });
  window.addEventListener("keyup", (event) => held && held.key === event.key && dropJog());

  // ---- what is shown is old when the page's process has not been heard for a while
  let beat = null;
  let heardAt = performance.now();
  let linkShown = false;
  setInterval(() => {
    const link = linkShown ? null : document.querySelector(".bench-nav a[aria-current]");
    if (link) {
      linkShown = true;
      link.scrollIntoView({ inline: "center", block: "nearest" });
    }
    const now = document.getElementById("bench-beat")?.dataset.beat ?? null;
    if (now !== beat || document.hidden) {
      beat = now;
      heardAt = performance.now();
    }
    const stale = performance.now() - heardAt > STALE_MS;
    document.body.classList.toggle("bench-stale", stale);
    if (stale) dropJog();
  }, 250);

  // ---- a plot that is not displayed has no size to be fitted to. NiceGUI has it fitted even where it was taken
  // away while Plotly was still being loaded, and Plotly fails at that
  Object.defineProperty(window, "Plotly", {
    configurable: true,
    set(Plotly) {
      Object.defineProperty(window, "Plotly", { value: Plotly });
      const { resize } = Plotly.Plots;
      const displayed = (plot) => plot.getClientRects().length > 0;
      Plotly.Plots.resize = (plot) => (displayed(plot) ? resize(plot) : Promise.resolve(plot));
    },
  });
})();
