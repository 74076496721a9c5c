// Maps of many moments, shown in turn: a button plays and pauses, a slider chooses the moment.

export class Motion {
  /** `count` moments at `fps`; `show(moment)` makes one ready, `changed` draws it. */
  constructor(bar, count, fps, { show, changed }) {
    Object.assign(this, { count, fps, show, changed, moment: 0, shown: 0, isBusy: false, isPlaying: false });
    [this.button, this.slider, this.clock] = bar.children;
    bar.hidden = false;
    this.slider.max = this.count - 1;
    this.button.onclick = () => this.toggle();
    this.slider.oninput = () => {
      this.isPlaying = false;
      this.seek(Number(this.slider.value));
    };
    this.tell();
  }

  tell() {
    this.slider.value = this.moment;
    this.clock.value = `${(this.moment / this.fps).toFixed(2)} s`;
    this.button.textContent = this.isPlaying ? "❚❚" : "▶";
    this.button.title = this.button.ariaLabel = this.isPlaying ? "Pause (T)" : "Play (T)";
  }

  /** Shows a moment, or the one that is asked for meanwhile. */
  async seek(moment) {
    this.moment = moment;
    this.tell();
    if (this.isBusy) return;
    this.isBusy = true;
    try {
      while (this.shown !== this.moment) {
        const next = this.moment;
        await this.show(next);
        this.shown = next;
        this.changed();
      }
    } catch (error) {
      this.pause();
      this.clock.value = error.message;
    }
    this.isBusy = false;
  }

  toggle() { return this.isPlaying ? this.pause() : this.play(); }

  pause() {
    this.isPlaying = false;
    this.tell();
  }

  /** On from here, from the start again behind the end; moments are left out where the browser is slower. */
  async play() {
    this.isPlaying = true;
    const began = performance.now() - (1000 * this.moment) / this.fps;
    while (this.isPlaying) {
      const now = await new Promise((resolve) => requestAnimationFrame(resolve));
      if (this.isPlaying) await this.seek(Math.floor((Math.max(now - began, 0) * this.fps) / 1000) % this.count);
    }
    this.changed();
  }
}
