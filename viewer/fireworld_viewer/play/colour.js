// Colors, [red, green, blue] from 0 to 255: as text, shaded, and so that they can be seen on a ground.

export function css(rgb) {
  return `rgb(${rgb.map(Math.round).join(",")})`;
}

export function mixed(rgb, other, share) {
  return rgb.map((part, k) => part + (other[k] - part) * share);
}

// The relative luminance of WCAG 2, 0 to 1.
export function luminance(rgb) {
  const [red, green, blue] = rgb.map((part) => {
    const share = part / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

export function contrast(one, other) {
  const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
}

// The color, or the nearest to it on the way to black or white that stands out from the ground.
export function seenOn(rgb, ground, least = 3) {
  const end = luminance(ground) > 0.18 ? [0, 0, 0] : [255, 255, 255];
  for (let share = 0; share < 1; share += 0.05) {
    const found = mixed(rgb, end, share);
    if (contrast(found, ground) >= least) return found;
  }
  return end;
}

// Black or white, whichever is read more easily on a ground.
export function inkOn(ground) {
  return contrast([0, 0, 0], ground) > contrast([255, 255, 255], ground) ? "#000" : "#fff";
}

export function parsed(text) {
  const hex = text.trim().replace("#", "");
  return [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16));
}
