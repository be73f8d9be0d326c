(() => {
  const wrong = [], root = document.documentElement, add = text => wrong.length < 12 && wrong.push(text);
  const wide = Math.max(root.scrollWidth, document.body.scrollWidth);
  if (wide > innerWidth) {
    const widest = [...document.querySelectorAll("body *")].filter(e => e.getBoundingClientRect().right > innerWidth + 1 && !e.closest(".sheet")).slice(0, 3);
    add(`the page is ${wide} wide: ${widest.map(e => e.outerHTML.slice(0, 80)).join("; ")}`);
  }
  const canvas = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true });
  const parsed = colour => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = colour;
    canvas.fillRect(0, 0, 1, 1);
    return [...canvas.getImageData(0, 0, 1, 1).data];
  };
  const light = rgb => {
    const [r, g, b] = rgb.slice(0, 3).map(c => c / 255).map(c => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ratio = (a, b) => { const [x, y] = [light(a), light(b)].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05); };
  const ground = element => {
    for (let at = element; at; at = at.parentElement) {
      const colour = parsed(getComputedStyle(at).backgroundColor);
      if (colour[3] === 255) return colour;
    }
    return [255, 255, 255, 255];
  };
  for (const element of document.querySelectorAll("body *:not(script):not(style):not(noscript)")) {
    const own = [...element.childNodes].some(node => node.nodeType === 3 && node.textContent.trim());
    const style = getComputedStyle(element);
    if (!own || style.visibility === "hidden" || !element.getClientRects().length) continue;
    let size = parseFloat(style.fontSize);
    const svg = element.closest("svg");
    const matrix = svg && element.getScreenCTM();
    // Rotated letters are as large as upright ones.
    if (matrix) size *= Math.hypot(matrix.a, matrix.b);
    const named = `${element.tagName} ${element.textContent.trim().slice(0, 30)}`;
    // Lowered letters are three quarters of the others.
    if (size < (element.tagName === "tspan" ? 8 : 11) - 0.01) add(`${named}: ${size} px`);
    if (svg) continue;
    const least = size >= 24 || (size >= 18.66 && +style.fontWeight >= 700) ? 3 : 4.5;
    const found = ratio(parsed(style.color), ground(element));
    if (found < least) add(`${named}: contrast ${found.toFixed(2)}`);
  }
  const css = name => getComputedStyle(root).getPropertyValue("--" + name).trim();
  const card = parsed(css("card")), band = parsed(css("band"));
  const letters = ["text", "muted", "bad"], inks = ["text", "u", "v", "w", "torque", "ripple", "speed", "link", "flux", "muted"];
  for (const [names, grounds, least] of [[letters, [card], 4.5], [["text"], [parsed(css("line")), parsed(css("press"))], 4.5], [inks, [card, band], 3]]) {
    for (const name of names) for (const under of grounds) if (ratio(parsed(css(name)), under) < least) add(`--${name}: contrast ${ratio(parsed(css(name)), under).toFixed(2)}`);
  }
  if (typeof report !== "undefined") {
    if (parseFloat(report.font) < 11) add(`letters of axes: ${report.font}`);
    for (const scope of report.scopes) for (const plot of scope.plots) {
      if (plot.axes.some(axis => parseFloat(axis.font[0] ?? axis.font) / (devicePixelRatio || 1) < 11)) add("an axis with letters under 11 px");
      if (plot.width > innerWidth) add(`a plot of ${plot.width} px`);
    }
  }
  return wrong;
})()
