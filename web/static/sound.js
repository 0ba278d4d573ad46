// The sound of two notes and the notification, for bell.js. A browser lets a page sound only after somebody has used it.
const NOTES = [[659.3, 0], [880, 0.18]]; // Hz, and s after the beginning
const LENGTH = 0.4, LOUD = 0.15; // s, and the loudest amplitude
let context = null;

async function sound() {
  context ??= new AudioContext();
  await context.resume();
  for (const [pitch, after] of NOTES) {
    const begin = context.currentTime + after, tone = new OscillatorNode(context, { frequency: pitch }), volume = new GainNode(context, { gain: 0 });
    volume.gain.setValueAtTime(0, begin);
    volume.gain.linearRampToValueAtTime(LOUD, begin + 0.02);
    volume.gain.exponentialRampToValueAtTime(0.001, begin + LENGTH);
    tone.connect(volume).connect(context.destination);
    tone.start(begin);
    tone.stop(begin + LENGTH);
  }
}

// It was turned on by a click: sound once, and ask whether notifications may be shown.
export function begin() {
  sound();
  if (globalThis.Notification?.permission === "default") Notification.requestPermission();
}

export function ring(words) {
  sound();
  if (!document.hidden || globalThis.Notification?.permission !== "granted") return;
  try {
    const told = new Notification(words, { tag: location.pathname });
    told.addEventListener("click", () => { window.focus(); told.close(); });
  } catch { /* a phone's browser shows none without a service worker: the sound has to do */ }
}
