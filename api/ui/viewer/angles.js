// Directions are unit vectors: east, north, up. Angles are degrees, azimuths clockwise from north.

export const RAD = Math.PI / 180;
export const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
export const turnOf = (degrees) => ((degrees % 360) + 360) % 360;

export const direction = (azimuth, elevation) => [
  Math.cos(elevation * RAD) * Math.sin(azimuth * RAD), Math.cos(elevation * RAD) * Math.cos(azimuth * RAD), Math.sin(elevation * RAD)];
export const azimuthOf = ([x, y]) => turnOf(Math.atan2(x, y) / RAD);
export const elevationOf = ([, , z]) => Math.asin(clamp(z, -1, 1)) / RAD;
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// A camera without roll: its axes to the right, up and ahead.
export function camera(azimuth, elevation) {
  const ahead = direction(azimuth, elevation);
  const right = [Math.cos(azimuth * RAD), -Math.sin(azimuth * RAD), 0];
  const up = direction(azimuth, elevation + 90);
  return { right, up, ahead };
}

// Where the sun stands, to a few hundredths of a degree: only to find the time of day of a place in the sky that was pointed at.
export function sunAt(date, latitude, longitude) {
  const days = date / 86400000 - 10957.5;
  const mean = (357.529 + 0.98560028 * days) * RAD;
  const ecliptic = (280.459 + 0.98564736 * days + 1.915 * Math.sin(mean) + 0.02 * Math.sin(2 * mean)) * RAD;
  const tilt = 23.439 * RAD;
  const declination = Math.asin(Math.sin(tilt) * Math.sin(ecliptic));
  const ascension = Math.atan2(Math.cos(tilt) * Math.sin(ecliptic), Math.cos(ecliptic));
  const hour = (280.46062 + 360.98564737 * days + longitude) * RAD - ascension;
  const phi = latitude * RAD;
  return [-Math.cos(declination) * Math.sin(hour),
    Math.sin(declination) * Math.cos(phi) - Math.cos(declination) * Math.sin(phi) * Math.cos(hour),
    Math.sin(declination) * Math.sin(phi) + Math.cos(declination) * Math.cos(phi) * Math.cos(hour)];
}
