// Draws a slice of particles, displaced and colored by damage, at a time that a slider chooses; another slider magnifies.
// data: see slices.rs.
function drawSlice(canvasId, timeId, scaleId, data) {
  const decode = text => new DataView(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
  const particles = decode(data.particles), count = particles.byteLength / 6;
  const frames = data.frames.map(frame => decode(frame.moved));
  const canvas = document.getElementById(canvasId);
  const [time, scale] = [timeId, scaleId].map(id => document.getElementById(id));
  const ramp = [[216, 222, 228], [226, 110, 52], [120, 18, 16]];
  const color = shade => {
    const t = shade / 255 * 2, k = Math.min(1, Math.floor(t)), f = t - k;
    return `rgb(${[0, 1, 2].map(c => Math.round(ramp[k][c] + f * (ramp[k + 1][c] - ramp[k][c]))).join()})`;
  };
  const colors = Array.from({length: 256}, (_, shade) => color(shade));
  // The middle of the slider is the magnification of the page; both ends are a hundred times smaller and larger, and 1 is among them.
  const factor = () => {
    const power = (Number(scale.value) - 20) / 10, value = data.magnify * 10 ** power;
    return value < 1 ? 1 : Number(value.toPrecision(2));
  };
  const draw = () => {
    const k = Number(time.value), frame = frames[k], by = factor();
    [[time, data.frames[k].label], [scale, String(by)]].forEach(([slider, text]) => {
      slider.parentElement.querySelector("output").textContent = text;
      slider.setAttribute("aria-valuetext", text);
    });
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = width * ratio; canvas.height = height * ratio;
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    const zoom = 0.88 * Math.min(width / data.size[0], height / data.size[1]);
    const [left, bottom] = [(width - zoom * data.size[0]) / 2, (height + zoom * data.size[1]) / 2];
    for (let p = 0; p < count; p++) {
      const [u, v, r] = [0, 2, 4].map(c => particles.getUint16(6 * p + c, true));
      const [du, dv] = [0, 2].map(c => frame.getInt16(5 * p + c, true) / 32767 * data.unit * by);
      pen.fillStyle = colors[frame.getUint8(5 * p + 4)];
      pen.beginPath();
      pen.arc(left + zoom * (u + du), bottom - zoom * (v + dv), Math.max(0.8, zoom * r), 0, 2 * Math.PI);
      pen.fill();
    }
  };
  [time, scale].forEach(slider => slider.addEventListener("input", draw));
  ["resize", "beforeprint"].forEach(name => window.addEventListener(name, draw));
  draw();
}
