// A part of a picture is chosen, with the pointer or with the keyboard.

/**
 * Lets a stretch of x, or a rectangle, be chosen with pointer or keyboard.
 * `chosen([[x, x], [y, y]] or null)` is told; the arrow keys move a stretch, Escape drops it.
 */
export function brush(plot, chosen, { both = false } = {}) {
  const canvas = plot.canvas;
  canvas.classList.add("brush");
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "application");
  canvas.setAttribute(
    "aria-roledescription",
    "picture; arrow keys choose a part, with Shift they widen it, Escape drops it",
  );
  let start = null;
  let part = null;
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return plot.at(event.clientX - box.left, event.clientY - box.top);
  };
  const tell = (a, b) => {
    part = [
      [Math.min(a[0], b[0]), Math.max(a[0], b[0])],
      both ? [Math.min(a[1], b[1]), Math.max(a[1], b[1])] : [-Infinity, Infinity],
    ];
    chosen(part);
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (!plot.box) return;
    start = place(event);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (start) tell(start, place(event));
  });
  canvas.addEventListener("pointerup", (event) => {
    if (!start) return;
    const end = place(event);
    const small = Math.abs(plot.px(end[0]) - plot.px(start[0])) < 4;
    if (small && (!both || Math.abs(plot.py(end[1]) - plot.py(start[1])) < 4)) {
      part = null;
      chosen(null);
    }
    start = null;
  });
  canvas.addEventListener("pointercancel", () => (start = null));
  canvas.addEventListener("keydown", (event) => {
    if (!plot.box) return;
    if (event.key === "Escape") {
      part = null;
      chosen(null);
      return;
    }
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] }[event.key];
    if (!way || (!both && way[1])) return;
    event.preventDefault();
    const [w, t] = [plot.x1 - plot.x0, plot.y1 - plot.y0];
    if (part === null) {
      tell([plot.x0 + 0.4 * w, plot.y0 + 0.4 * t], [plot.x0 + 0.6 * w, plot.y0 + 0.6 * t]);
      return;
    }
    const [[a, b], [d, e]] = part;
    const [dx, dy] = [0.05 * w * way[0], 0.05 * t * way[1]];
    if (event.shiftKey) tell([a - dx, d - dy], [b + dx, e + dy]);
    else tell([a + dx, d + dy], [b + dx, e + dy]);
  });
}
