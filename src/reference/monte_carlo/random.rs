//! Random numbers: xoshiro256++ of D. Blackman and S. Vigna (2018), seeded by splitmix64 as they advise.

/// One stream of random numbers.
#[derive(Debug)]
pub(super) struct Random {
    state: [u64; 4],
}

impl Random {
    /// Stream number `stream` of a seed. Streams start at unrelated places of a period of 2^256.
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        let mut counter = split_mix(seed) ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Self {
            state: std::array::from_fn(|_| {
                counter = counter.wrapping_add(0x9e37_79b9_7f4a_7c15);
                split_mix(counter)
            }),
        }
    }

    /// Uniform in 0..1, 1 excluded; 53 bits.
    pub(super) fn uniform(&mut self) -> f64 {
        let s = &mut self.state;
        let result = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let shifted = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= shifted;
        s[3] = s[3].rotate_left(45);
        (result >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Optical path to the next event: exponentially distributed with mean 1.
    pub(super) fn free_path(&mut self) -> f64 {
        // 1 less the uniform number is exact.
        -(1.0 - self.uniform()).ln()
    }
}

/// Mixes a counter: the output function of splitmix64.
fn split_mix(counter: u64) -> u64 {
    let mut z = counter;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
