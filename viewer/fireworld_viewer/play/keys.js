// Keys for the whole page, wherever the focus is but in fields that take them themselves.

export function followKeys(player, timeline) {
  const beside = (way) => {
    const places = timeline.eventPlaces();
    const found = way > 0 ? places.find((one) => one > player.place) : places.findLast((one) => one < player.place);
    if (found !== undefined) player.go(found);
  };
  const does = {
    " ": () => player.toggle(),
    ArrowLeft: () => player.go(player.place - 1),
    ArrowRight: () => player.go(player.place + 1),
    PageUp: () => player.go(player.place - 10),
    PageDown: () => player.go(player.place + 10),
    Home: () => player.go(0),
    End: () => player.go(player.last),
    ",": () => beside(-1),
    ".": () => beside(1),
    "+": () => player.changeSpeed(1),
    "=": () => player.changeSpeed(1),
    "-": () => player.changeSpeed(-1),
  };
  const moves = new Set(["ArrowLeft", "ArrowRight", "PageUp", "PageDown", "Home", "End", ",", "."]);
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in does)) return;
    const { tagName, type } = event.target;
    if (tagName === "SELECT" || (tagName === "INPUT" && type !== "range")) return;
    if (event.key === " " && ["BUTTON", "A", "SUMMARY"].includes(tagName)) return;
    event.preventDefault();
    if (moves.has(event.key)) player.pause();
    does[event.key]();
  });
}
