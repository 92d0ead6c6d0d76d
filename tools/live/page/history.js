// The time strip: pictures so far, as many as fit into 64 MB, to look back at while the run goes on.
"use strict";

class PictureHistory {
  constructor(slider, now, label, show) {
    Object.assign(this, { slider, now, label, show, pictures: [], bytes: 0 });
    slider.addEventListener("input", () => {
      this.back = Number(slider.value) < this.pictures.length - 1;
      this.present();
    });
    now.addEventListener("click", () => {
      this.back = false;
      this.present();
    });
    this.clear();
  }

  clear() {
    this.pictures = [];
    this.bytes = 0;
    this.back = false;
  }

  add(buffer, picture, quantity) {
    const before = this.pictures[this.pictures.length - 1];
    if (before && picture.substep < before.picture.substep) this.clear();
    this.pictures.push({ picture, quantity, bytes: buffer.byteLength });
    this.bytes += buffer.byteLength;
    let gone = 0;
    while (this.bytes > 64e6 && this.pictures.length > 2) {
      this.bytes -= this.pictures.shift().bytes;
      ++gone;
    }
    const at = this.back ? Math.max(0, Number(this.slider.value) - gone) : this.pictures.length - 1;
    this.slider.max = this.pictures.length - 1;
    this.slider.value = at;
    if (!this.back) this.present();
    else this.tell();
  }

  present() {
    if (!this.back) this.slider.value = this.pictures.length - 1;
    const chosen = this.pictures[Number(this.slider.value)];
    if (chosen) this.show(chosen.picture, chosen.quantity);
    this.tell();
  }

  tell() {
    const chosen = this.pictures[Number(this.slider.value)];
    this.now.disabled = !this.back;
    this.label.textContent = chosen ? `${this.back ? "looking back: " : ""}${chosen.picture.time.toFixed(4)} s` : "";
  }
}
