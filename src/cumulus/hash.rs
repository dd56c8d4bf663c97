//! Random numbers that follow from whole numbers, so that nothing has to be remembered from one moment to the next.

/// Hash of three numbers (Jarzynski and Olano 2020, "pcg3d").
pub(super) fn pcg3d([x, y, z]: [u32; 3]) -> [u32; 3] {
    let turn = |v: u32| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let (mut x, mut y, mut z) = (turn(x), turn(y), turn(z));
    for round in 0..2 {
        x = x.wrapping_add(y.wrapping_mul(z));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
        if round == 0 {
            (x, y, z) = (x ^ (x >> 16), y ^ (y >> 16), z ^ (z >> 16));
        }
    }
    [x, y, z]
}

/// What a key is to have as its numbers: a key has very many.
pub(super) fn follow(key: [u32; 3], number: u32) -> [u32; 3] {
    pcg3d([key[0] ^ number, key[1], key[2]])
}

/// Three numbers from 0 to below 1.
pub(super) fn uniform(key: [u32; 3]) -> [f64; 3] {
    key.map(|bits| f64::from(bits) / 4_294_967_296.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_neighbours_are_spread_evenly() {
        let mut sums = [[0.0; 3]; 2];
        let mut products = 0.0;
        let count = 10_000;
        for number in 0..count {
            let (a, b) = (uniform(follow([7, 8, 9], number)), uniform(follow([7, 8, 9], number + 1)));
            for i in 0..3 {
                sums[0][i] += a[i];
                sums[1][i] += a[i] * a[i];
            }
            products += (a[0] - 0.5) * (b[0] - 0.5);
        }
        let count = f64::from(count);
        // Five standard errors.
        assert!(sums[0].iter().all(|sum| (sum / count - 0.5).abs() < 5.0 * 0.289 / count.sqrt()), "{sums:?}");
        assert!(sums[1].iter().all(|sum| (sum / count - 1.0 / 3.0).abs() < 5.0 * 0.298 / count.sqrt()), "{sums:?}");
        assert!((products / count).abs() < 5.0 / 12.0 / count.sqrt(), "{products}");
    }
}
