// Slabs of all depths as one direction shows them: what cloud_slabs makes and cloud_parallel reads. Of each depth three vectors: parts of even light
// that are sent back, and let through; scattered sunlight, per irradiance facing the sun.
//
// Depths are so close that light which dies away with depth is within a thousandth of itself between them, until a thousandth of it is left.
const SLABS_PER_OCTAVE: f32 = 64.0;
const SLABS_COUNT: u32 = 2113u;
