// Looks at each frame's page once it is shown, and writes what it finds as JSON into the first <pre>.
// Texts overlap where their boxes share more than two pixels each way. A box is one em high: that of a browser is as high as
// the font's own lines, and fonts differ. Small raised letters, and words that are slanted, are left out: their boxes are
// larger than they are.
const slanted = (element) => {
  const turned = /rotate\(\s*(-?[\d.]+)/.exec((element.getAttribute("transform") || "") + (element.getAttribute("style") || ""));
  return turned && turned[1] % 90 != 0;
};
const left_out = (element) => {
  const group = element.closest("g");
  return element.closest("sup, style, title, defs") || slanted(element) || (group && slanted(group));
};
const boxes_of = (page) => {
  const boxes = [];
  const walker = page.createTreeWalker(page.body, NodeFilter.SHOW_TEXT);
  for (let node; (node = walker.nextNode()); ) {
    const element = node.parentElement;
    if (!node.data.trim() || left_out(element)) continue;
    const range = page.createRange();
    range.selectNodeContents(node);
    const rectangles = element.closest("svg") ? [element.getBoundingClientRect()] : range.getClientRects();
    const em = element.closest("svg") ? Infinity : parseFloat(getComputedStyle(element).fontSize);
    for (const box of rectangles) {
      const spare = Math.max(0, box.height - em) / 2;
      const letters = { left: box.left, right: box.right, top: box.top + spare, bottom: box.bottom - spare };
      if (box.width > 0 && box.height > 0) boxes.push([letters, node.data.trim().slice(0, 30)]);
    }
  }
  return boxes.sort((upper, lower) => upper[0].top - lower[0].top);
};
const overlaps = (page) => {
  const boxes = boxes_of(page);
  const pairs = [];
  boxes.forEach(([upper, text], i) => {
    for (let j = i + 1; j < boxes.length && boxes[j][0].top < upper.bottom - 2; j++) {
      const lower = boxes[j][0];
      const across = Math.min(upper.right, lower.right) - Math.max(upper.left, lower.left);
      if (across > 2 && Math.min(upper.bottom, lower.bottom) - lower.top > 2) pairs.push(`${text} | ${boxes[j][1]}`);
    }
  });
  return pairs;
};
const cut = (page) =>
  [...page.querySelectorAll(".scroll, table, figure, pre, p")]
    .filter((element) => element.scrollWidth > element.clientWidth + 1)
    .map((element) => element.textContent.trim().slice(0, 60));
const beyond = (page) =>
  [...page.querySelectorAll("svg text")]
    .filter((element) => {
      const [text, picture] = [element, element.closest("svg")].map((part) => part.getBoundingClientRect());
      return text.left < picture.left - 1 || text.right > picture.right + 1;
    })
    .map((element) => element.textContent);
onload = () => {
  const frames = {};
  for (const frame of document.querySelectorAll("iframe")) {
    const page = frame.contentDocument;
    const whole = [...page.querySelectorAll("figure, tr, pre")].map((element) => element.getBoundingClientRect().height);
    frames[frame.id] = {
      window: page.documentElement.clientWidth,
      needed: page.documentElement.scrollWidth,
      texts: boxes_of(page).length,
      overlaps: overlaps(page),
      cut: cut(page),
      beyond: beyond(page),
      tallest: Math.max(...whole),
      fetched: frame.contentWindow.performance.getEntriesByType("resource").map((entry) => entry.name),
    };
  }
  document.querySelector("pre").textContent = JSON.stringify(frames);
};
