// Which step is shown: the one cursor of maps, curves and words; it plays, and it is part of the page's address.

export const SPEEDS = [1, 2, 5, 10, 20, 50];
const LONG_SECONDS = 30;

export class Player {
  constructor(steps) {
    Object.assign(this, { steps, place: 0, playing: false, listeners: [] });
    this.speed = SPEEDS.slice(1).find((speed) => steps.length / speed <= LONG_SECONDS) ?? SPEEDS.at(-1);
  }

  get step() {
    return this.steps[this.place];
  }

  get last() {
    return this.steps.length - 1;
  }

  onChange(listener) {
    this.listeners.push(listener);
  }

  tell() {
    for (const listener of this.listeners) listener(this);
  }

  go(place) {
    const next = Math.max(0, Math.min(this.last, Math.round(place)));
    if (next === this.place) return;
    this.place = next;
    if (next === this.last) this.playing = false;
    this.tell();
    if (!this.playing) this.writeAddress();
  }

  // Go to a step of a run, or the one before it where there is none of that number.
  goToStep(step) {
    const after = this.steps.findIndex((one) => one > step);
    this.go(after < 0 ? this.last : after - 1);
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.tell();
    this.writeAddress();
  }

  toggle() {
    if (this.playing) return this.pause();
    this.playing = true;
    if (this.place === this.last) this.place = 0;
    this.tell();
    this.due = performance.now();
    requestAnimationFrame((now) => this.tick(now));
    return undefined;
  }

  tick(now) {
    if (!this.playing) return;
    const n = Math.floor(((now - this.due) / 1000) * this.speed);
    if (n > 0) {
      this.due += (n / this.speed) * 1000;
      this.go(this.place + Math.min(n, 5));
    }
    requestAnimationFrame((later) => this.tick(later));
  }

  setSpeed(speed) {
    this.speed = speed;
    this.due = performance.now();
    this.tell();
  }

  changeSpeed(by) {
    const at = SPEEDS.indexOf(this.speed) + by;
    this.setSpeed(SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at))]);
  }

  writeAddress() {
    try {
      history.replaceState(null, "", `#${this.step}`);
    } catch {
      // inside another page there is no address of its own
    }
  }

  // Go to the step that the address names, else to the one given.
  readAddress(start = null) {
    const found = /^#(\d{1,9})$/.exec(location.hash);
    const step = found ? Number(found[1]) : start;
    if (step !== null) this.goToStep(step);
  }
}
