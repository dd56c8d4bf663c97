// Slabs of all depths as one direction shows them: what cloud_slabs makes and cloud_parallel reads. Of each depth three vectors: parts of even light
// that are sent back, and let through; scattered sunlight, per irradiance facing the sun.
//
// Between depths they are blended evenly. The tables that they come from are blended so too, at nodes of their own, so that parabolas would do worse; depths are so
// close that the mean over a picture is within a few parts in a million.
const SLABS_PER_OCTAVE: f32 = 192.0;
const SLABS_COUNT: u32 = 6337u;
