// Watches that the server is there: what fails is told within three seconds, and when it is back.
const EVERY_MS = 900;
const LONGEST_MS = 1900;

export function watch(tell) {
  let gone = null;
  const look = async () => {
    let alive = false;
    try {
      alive = (await fetch("/health/live", { signal: AbortSignal.timeout(LONGEST_MS), cache: "no-store" })).ok;
    } catch { /* it is not there, or too busy to say a word */ }
    if (alive && gone) { gone = null; tell(null); }
    if (!alive && !gone) gone = new Date();
    if (gone) tell(gone);
    setTimeout(look, EVERY_MS);
  };
  look();
}
