"use strict";
// How the flights of a page moved: the channels of each, read at any time.

class Motion {
  constructor(channels) {
    this.channels = Object.fromEntries(Object.entries(channels).map(([name, text]) => [name, floats(text)]));
    this.time = this.channels.time;
    this.last = this.time.at(-1);
    this.followsAltitude = "reference" in this.channels;
  }

  // Index of the moment at or before a time [s].
  index(time) {
    let low = 0, high = this.time.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  // All channels at a time [s]; before the flight its start, after it its end.
  at(time) {
    const i = this.index(time), j = Math.min(i + 1, this.time.length - 1);
    const gap = this.time[j] - this.time[i];
    const share = gap > 0 ? Math.min(Math.max((time - this.time[i]) / gap, 0), 1) : 0;
    return Object.fromEntries(Object.entries(this.channels).map(([name, values]) =>
      [name, values[i] + share * (values[j] - values[i])]));
  }

  range(...names) {
    let low = Infinity, high = -Infinity;
    for (const name of names) {
      for (const value of this.channels[name] ?? []) [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
    return [low, high];
  }
}
