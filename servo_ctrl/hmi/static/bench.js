// What works in the browser without the server: STOP, holding a jog button, noticing that the page is stale,
// and plots that are not displayed.
"use strict";
(() => {
  const RENEW_MS = 100; // the controller ends a jog that was not renewed for 250 ms
  const STALE_MS = 2000;
  const STOP_ANSWER_MS = 2000;

  // ---- STOP: a request of its own, which does not need the page's websocket
  async function stop() {
    endJog();
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
        const result = await answer.json();
        if (!result.accepted) failed = result.reason || "refused";
      }
    } catch (error) {
      failed = "no answer";
    }
    setTimeout(() => button?.classList.remove("sent"), 400);
    const banner = document.getElementById("bench-stop-failed");
    if (banner) {
      banner.hidden = failed === "";
      banner.textContent = failed && `${banner.dataset.text} (${failed})`;
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
      // by Enter or Space on the focused button, or by an assistive tool; pointers are handled above
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
    } else endJog();
  }
  function startJog(element, key) {
    if (held?.element === element) return;
    endJog();
    if (element.disabled || element.getAttribute("aria-disabled") === "true") return;
    held = { element, key, timer: setInterval(renew, RENEW_MS) };
    element.classList.add("held");
    renew();
  }
  function endJog() {
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
      startJog(element, null);
    }
  });
  for (const name of ["pointerup", "pointercancel"]) {
    window.addEventListener(name, () => held && held.key === null && endJog(), true);
  }
  document.addEventListener("pointermove", (event) => {
    // a finger that slides off the button releases it
    if (!held || held.key !== null) return;
    const under = document.elementFromPoint(event.clientX, event.clientY);
    if (!under || !held.element.contains(under)) endJog();
  });
  document.addEventListener("contextmenu", (event) => event.target.closest?.("[data-jog]") && event.preventDefault());
  window.addEventListener("blur", endJog);
  window.addEventListener("pagehide", endJog);
  document.addEventListener("visibilitychange", () => document.hidden && endJog());
  document.addEventListener("focusin", (event) => held && held.key !== null && isInput(event.target) && endJog());

  const isInput = (element) =>
    element?.closest?.("input, textarea, select, [contenteditable=true], [role=listbox], [role=slider], [role=tree]");
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || isInput(document.activeElement)) return;
    const focused = document.activeElement?.closest?.("[data-jog]");
    const byFocus = focused && (event.key === " " || event.key === "Enter");
    if (event.shiftKey && !byFocus) {
      // one press is one step, however long it is held
      const step = document.querySelector(`[data-step-key="${CSS.escape(event.key)}"]`);
      if (!step) return;
      event.preventDefault();
      if (!event.repeat && !step.disabled && !document.body.classList.contains("bench-stale")) step.click();
      return;
    }
    const element = byFocus ? focused : document.querySelector(`[data-jog-key="${CSS.escape(event.key)}"]`);
    if (!element) return;
    event.preventDefault();
    if (!event.repeat) startJog(element, event.key);
  });
  window.addEventListener("keyup", (event) => held && held.key === event.key && endJog());

  // ---- the page is stale when its process has sent no beat for STALE_MS
  let beat = null;
  let beatAt = performance.now();
  let linkInView = false;
  setInterval(() => {
    const link = linkInView ? null : document.querySelector(".bench-nav a[aria-current]");
    if (link) {
      linkInView = true;
      // whoever is in this bar already must not lose what has the focus
      const isUsed = link.closest(".bench-bar").contains(document.activeElement);
      if (!isUsed) link.scrollIntoView({ inline: "center", block: "nearest" });
    }
    const now = document.querySelector(".bench-beat")?.textContent ?? null;
    if (now !== beat || document.hidden) {
      beat = now;
      beatAt = performance.now();
    }
    const stale = performance.now() - beatAt > STALE_MS;
    document.body?.classList.toggle("bench-stale", stale); // a slow page has no body yet
    if (stale) endJog();
  }, 250);

  // ---- Plotly fails to resize a plot that is not displayed, and NiceGUI resizes even one that was removed while
  // Plotly was being loaded
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
