// Shows the nearest point of a chart under the pointer: name of the series, abscissa, ordinate.
document.addEventListener("DOMContentLoaded", () => {
  const shown = value => {
    const size = Math.abs(value);
    if (value === 0) return "0";
    if (size < 1e5 && size >= 1e-3) return value.toPrecision(4).replace("-", "−");
    const [mantissa, power] = value.toExponential(2).replace("+", "").split("e");
    return `${mantissa.replace("-", "−")}·10${[...power].map(c => c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]).join("")}`;
  };
  const tag = (name, attributes, parent) => {
    const element = parent.appendChild(document.createElementNS("http://www.w3.org/2000/svg", name));
    Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
    return element;
  };
  // Nearest point of a line, or nearest vertex of a scatter.
  const nearest = (points, scatter, at) => {
    let best = {distance: Infinity};
    const offer = (x, y) => {
      const distance = Math.hypot(x - at.x, y - at.y);
      if (distance < best.distance) best = {distance, x, y};
    };
    points.forEach((p, k) => {
      offer(p.x, p.y);
      if (scatter || k === 0) return;
      const q = points[k - 1], [dx, dy] = [p.x - q.x, p.y - q.y], square = dx * dx + dy * dy;
      const t = square > 0 ? ((at.x - q.x) * dx + (at.y - q.y) * dy) / square : 0;
      if (t > 0 && t < 1) offer(q.x + t * dx, q.y + t * dy);
    });
    return best;
  };
  // Ordinate of a line at an abscissa.
  const ordinate = (points, x) => {
    const k = points.findIndex((p, k) => k > 0 && Math.min(p.x, points[k - 1].x) <= x && x <= Math.max(p.x, points[k - 1].x));
    if (k < 0) return undefined;
    const [p, q] = [points[k - 1], points[k]];
    return q.x === p.x ? q.y : p.y + (x - p.x) / (q.x - p.x) * (q.y - p.y);
  };
  document.querySelectorAll("svg.chart").forEach(svg => {
    const scale = text => {
      const [low, high, from, to, logarithmic] = text.split(" ").map(Number);
      return place => {
        const share = (place - from) / (to - from);
        return logarithmic ? low * Math.pow(high / low, share) : low + share * (high - low);
      };
    };
    const [x, y] = [scale(svg.dataset.x), scale(svg.dataset.y)];
    const lines = [...svg.querySelectorAll("polyline[data-name]")].map(line => ({
      name: line.dataset.name, scatter: "scatter" in line.dataset, stacked: "stacked" in line.dataset, points: [...line.points],
    }));
    const layer = tag("g", {class: "readout", visibility: "hidden"}, svg);
    const dot = tag("circle", {r: 4}, layer), texts = [0, 1, 2].map(() => tag("text", {class: "halo"}, layer));
    svg.addEventListener("pointerenter", () => {
      // The browser would show the title over the read-out.
      const title = svg.querySelector("title");
      if (!title) return;
      svg.setAttribute("aria-label", title.textContent);
      svg.removeAttribute("aria-labelledby");
      title.remove();
    }, {once: true});
    const move = event => {
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      let best = {distance: Infinity};
      lines.forEach((line, k) => {
        const found = nearest(line.points, line.scatter, at);
        if (found.distance < best.distance) best = {...found, line, k};
      });
      layer.setAttribute("visibility", best.distance < 60 ? "visible" : "hidden");
      if (!(best.distance < 60)) return;
      let value = y(best.y);
      if (best.line.stacked) {
        const below = lines.slice(0, best.k).reverse().find(line => line.stacked);
        const floor = below && ordinate(below.points, best.x);
        if (floor !== undefined) value -= y(floor);
      }
      dot.setAttribute("cx", best.x);
      dot.setAttribute("cy", best.y);
      const left = best.x > 270, top = Math.max(best.y, 64);
      const read = [best.line.name, `${svg.dataset.xLabel}: ${shown(x(best.x))}`, `${svg.dataset.yLabel}: ${shown(value)}`];
      read.forEach((text, k) => {
        texts[k].textContent = text;
        texts[k].setAttribute("text-anchor", left ? "end" : "start");
        texts[k].setAttribute("x", best.x + (left ? -10 : 10));
        texts[k].setAttribute("y", top - 42 + 17 * k);
      });
    };
    svg.addEventListener("pointermove", move);
    svg.addEventListener("pointerdown", move);
    svg.addEventListener("pointerleave", () => layer.setAttribute("visibility", "hidden"));
  });
});
