// Draws damaged bonds as points: a front view, and a view that rotates by pointer and arrow keys.
// data: {size: [x, y, z], widest: largest opening in µm, points: base 64 of x, y, z as 16-bit numbers, a shade, and the root of the
// opening, 8 bits each, for each point}; coordinates
// are 0 to 10000 of the longest edge. A plane run adds discs: base 64 of x, y, and radius as 16-bit numbers for each particle.
// Two sliders hide bonds below a shade and an opening; a text says how many are shown.
function drawCracks(frontId, turnId, [leastId, openId, shownId], data) {
  const bytes = Uint8Array.from(atob(data.points), c => c.charCodeAt(0));
  const count = bytes.length / 8, half = data.size.map(s => s / 2);
  const plane = data.discs !== undefined, discs = Uint8Array.from(atob(data.discs || ""), c => c.charCodeAt(0));
  const coordinate = (k, c) => bytes[8 * k + 2 * c] + 256 * bytes[8 * k + 2 * c + 1];
  const ramp = [[244, 205, 160], [226, 110, 52], [120, 18, 16]];
  const color = shade => {
    const t = shade / 255 * 2, k = Math.min(1, Math.floor(t)), f = t - k;
    return `rgb(${[0, 1, 2].map(c => Math.round(ramp[k][c] + f * (ramp[k + 1][c] - ramp[k][c]))).join()})`;
  };
  const colors = Array.from({length: 256}, (_, shade) => color(shade));
  const corners = [...Array(8).keys()].map(k => [k & 1, k >> 1 & 1, k >> 2 & 1].map((b, c) => (b * 2 - 1) * half[c]));
  const edges = [[0,1],[2,3],[4,5],[6,7],[0,2],[1,3],[4,6],[5,7],[0,4],[1,5],[2,6],[3,7]];
  const reach = Math.hypot(...half);
  let least = 0, open = 0;
  const isShown = k => bytes[8 * k + 6] >= least && bytes[8 * k + 7] >= open;

  function view(canvas, turn, tilt, zoom) {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = width * ratio; canvas.height = height * ratio;
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    const scale = zoom * Math.min(width, height) / 2;
    const [ct, st, ci, si] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
    // z is up; rotated about z, then tilted toward the viewer.
    const project = (x, y, z) => {
      const u = ct * x + st * y, v = ct * y - st * x;
      return [width / 2 + scale * u, height / 2 - scale * (ci * z + si * v)];
    };
    pen.strokeStyle = "#c3c8ce";
    pen.beginPath();
    for (const [a, b] of edges) {
      const p = project(...corners[a]), q = project(...corners[b]);
      pen.moveTo(p[0], p[1]); pen.lineTo(q[0], q[1]);
    }
    pen.stroke();
    pen.beginPath();
    for (let k = 0; k < discs.length / 6; k++) {
      const [x, y, r] = [0, 1, 2].map(c => discs[6 * k + 2 * c] + 256 * discs[6 * k + 2 * c + 1]);
      const [u, v] = project(x - half[0], y - half[1], 0);
      pen.moveTo(u + r * scale, v);
      pen.ellipse(u, v, r * scale, r * scale * Math.abs(si), 0, 0, 2 * Math.PI);
    }
    pen.stroke();
    // Points come from the most to the least damaged; the most damaged are drawn last, on top.
    const size = Math.max(1.6, Math.min(5, 90 / Math.cbrt(count + 1)));
    for (let k = count - 1; k >= 0; k--) {
      if (!isShown(k)) continue;
      const [x, y] = project(...half.map((h, c) => coordinate(k, c) - h));
      pen.fillStyle = colors[bytes[8 * k + 6]];
      pen.fillRect(x - size / 2, y - size / 2, size, size);
    }
    // Axes in the corner.
    pen.font = "12px system-ui, sans-serif"; pen.textAlign = "center"; pen.textBaseline = "middle";
    const origin = project(0, 0, 0);
    [["x", 1, 0, 0], ["y", 0, 1, 0], ["z", 0, 0, 1]].forEach(([name, x, y, z]) => {
      const tip = project(x, y, z).map((value, c) => value - origin[c]);
      const length = Math.hypot(tip[0], tip[1]) / scale;
      if (length < 0.05) return;
      const [dx, dy] = [tip[0] / scale * 24, tip[1] / scale * 24];
      pen.strokeStyle = "#5b6570";
      pen.beginPath(); pen.moveTo(40, height - 40); pen.lineTo(40 + dx, height - 40 + dy); pen.stroke();
      pen.fillStyle = "#38414a";
      pen.fillText(name, 40 + dx * 1.4, height - 40 + dy * 1.4);
    });
  }

  const front = document.getElementById(frontId), turning = document.getElementById(turnId);
  // A plane is seen from above.
  let turn = plane ? 0.3 : 0.6, tilt = plane ? 0.9 : 0.35;
  const all = () => {
    view(front, 0, plane ? Math.PI / 2 : 0, 0.86 / Math.max(half[0], half[plane ? 1 : 2]));
    view(turning, turn, tilt, 0.92 / reach);
  };
  const rotate = (by, tiltBy) => {
    turn += by;
    tilt = Math.max(-1.57, Math.min(1.57, tilt + tiltBy));
    view(turning, turn, tilt, 0.92 / reach);
  };
  const keys = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1]};
  turning.addEventListener("keydown", event => {
    if (!keys[event.key]) return;
    event.preventDefault();
    rotate(...keys[event.key]);
  });
  turning.addEventListener("pointerdown", start => {
    turning.setPointerCapture(start.pointerId);
    let [x, y] = [start.clientX, start.clientY];
    const move = event => {
      rotate((event.clientX - x) * 0.01, (event.clientY - y) * 0.01);
      [x, y] = [event.clientX, event.clientY];
    };
    turning.addEventListener("pointermove", move);
    // A touch may end without "pointerup".
    const end = () => turning.removeEventListener("pointermove", move);
    ["pointerup", "pointercancel"].forEach(name => turning.addEventListener(name, end, {once: true}));
  });
  const sliders = [leastId, openId].map(id => document.getElementById(id));
  const choose = () => {
    [least, open] = sliders.map(slider => Number(slider.value));
    // The scale of the shades: 0.5 to 0.999, every factor of ten in 1 − damage a step of equal length.
    const damage = 1 - 0.5 * 10 ** (-least / 255 * Math.log10(500));
    [damage.toPrecision(3), `${((open / 255) ** 2 * data.widest).toPrecision(3)} µm`].forEach((text, k) => {
      sliders[k].parentElement.querySelector("output").textContent = text;
      sliders[k].setAttribute("aria-valuetext", text);
    });
    let visible = 0;
    for (let k = 0; k < count; k++) visible += isShown(k);
    document.getElementById(shownId).textContent = `${visible} of ${count} bonds are shown.`;
    all();
  };
  sliders.forEach(slider => slider.addEventListener("input", choose));
  choose();
  window.addEventListener("resize", all);
  // The canvas of a printed page has another width.
  window.addEventListener("beforeprint", all);
  all();
}
