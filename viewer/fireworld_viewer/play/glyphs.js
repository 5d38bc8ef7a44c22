// What stands for brigades, tanks, water and civilians, on maps and in the legend.
import { css, inkOn } from "./colour.js";
import { CIVILIAN_RADIUS } from "./spots.js";

export const HEALTH = ["well", "hurt", "dying", "dead"];

function stroke(pen, color, width) {
  pen.strokeStyle = color;
  pen.lineWidth = width;
  pen.stroke();
}

// A ball with a number in it.
export function drawBall(pen, left, top, radius, rgb, number) {
  pen.beginPath();
  pen.arc(left, top, radius, 0, 2 * Math.PI);
  pen.fillStyle = css(rgb);
  pen.fill();
  stroke(pen, "#000", 1.2);
  pen.font = `bold ${number.length > 2 ? 9 : 11}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = inkOn(rgb);
  pen.fillText(number, left, top + 0.5);
}

// An upright tank of which a share, 0 to 1, is full.
export function drawTank(pen, left, top, [wide, high], share, look) {
  pen.fillStyle = "#fff";
  pen.fillRect(left, top, wide, high);
  pen.fillStyle = css(look.water);
  pen.fillRect(left, top + high * (1 - share), wide, high * share);
  pen.strokeStyle = "#000";
  pen.lineWidth = 0.9;
  pen.strokeRect(left, top, wide, high);
}

// A civilian: a dot in the color of health, a cross for the dead.
export function drawPerson(pen, left, top, look, health) {
  const [color, size] = [css(look.health[health]), CIVILIAN_RADIUS];
  pen.beginPath();
  if (HEALTH[health] === "dead") {
    for (const way of [1, -1]) {
      pen.moveTo(left - size, top - way * size);
      pen.lineTo(left + size, top + way * size);
    }
    stroke(pen, "#fff", 5);
    stroke(pen, color, 2.4);
    return;
  }
  pen.arc(left, top, size, 0, 2 * Math.PI);
  stroke(pen, "#000", 1.2);
  pen.fillStyle = color;
  pen.fill();
}

export function drawJet(pen, from, to, look, theme) {
  line(pen, from, to);
  stroke(pen, theme.jetEdge, 5);
  stroke(pen, css(look.water), 3);
}

export function drawWay(pen, from, to, theme) {
  line(pen, from, to);
  stroke(pen, theme.casing, 3);
  pen.setLineDash([4, 4]);
  stroke(pen, theme.ink, 1.2);
  pen.setLineDash([]);
}

function line(pen, from, to) {
  pen.beginPath();
  pen.moveTo(...from);
  pen.lineTo(...to);
}
