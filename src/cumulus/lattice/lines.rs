//! The lines of a lattice: cubes in the order in which light passes them.

/// A family of parallel lines: along an edge of the cubes or along a diagonal.
pub(super) struct Family {
    /// From one cube to the next.
    pub(super) step: [i32; 3],
    /// Slots of cubes, line after line.
    pub(super) order: Vec<u32>,
    /// Where each line begins in `order`, and where the last one ends.
    pub(super) starts: Vec<u32>,
    /// Part of the light that reaches each cube of `order` from the one before, the first from the last of a level line.
    pub(super) follow: Vec<f32>,
}

/// Each of the 14 directions stands for a wide cone of light. What leaves a cloud along it meets the next cloud as a whole only where that
/// is close: across a gap of this length, metres, half of the light comes from beside the cloud. It is about the size of a cloud, and not
/// fitted.
const GAP_M: f64 = 300.0;

/// All families: three along edges, four along diagonals. Light runs along each both ways.
pub(super) struct Lines(pub(super) [Family; 7]);

const STEPS: [[i32; 3]; 7] = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]];

impl Lines {
    /// `places` are those of the cubes, lowest slices first, within a slice along x, then y; `slots` where their light is kept.
    pub(super) fn new(places: &[[u32; 3]], slots: &[u32], size: [usize; 3], cell_m: f64) -> Self {
        Self(STEPS.map(|step| family(places, slots, size, cell_m, step)))
    }
}

fn family(places: &[[u32; 3]], slots: &[u32], size: [usize; 3], cell_m: f64, step: [i32; 3]) -> Family {
    let [nx, ny, nz] = size;
    let (width, lines) = match step {
        [1, 0, 0] => (ny, ny * nz),
        [0, 1, 0] => (nx, nx * nz),
        _ => (nx, nx * ny),
    };
    // A line that leaves the domain at one side comes in at the other: the domain repeats.
    let line = |&[x, y, z]: &[u32; 3]| -> usize {
        let (x, y, z) = (x as usize, y as usize, z as usize);
        let (across, along) = match step {
            [1, 0, 0] => (y, z),
            [0, 1, 0] => (x, z),
            [0, 0, 1] => (x, y),
            [i, j, _] => {
                let back = |at: usize, step: i32, n: usize| {
                    (at as i64 - i64::from(step) * z as i64).rem_euclid(n as i64) as usize
                };
                (back(x, i, nx), back(y, j, ny))
            }
        };
        across + width * along
    };
    let mut starts = vec![0_u32; lines + 1];
    for place in places {
        starts[line(place) + 1] += 1;
    }
    for i in 0..lines {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut order = vec![0_u32; places.len()];
    for (number, place) in places.iter().enumerate() {
        let at = &mut next[line(place)];
        order[*at as usize] = number as u32;
        *at += 1;
    }
    // Lines without a cube of their own are nobody's work.
    starts.dedup();
    let length_m = step.map(|step| f64::from(step * step)).iter().sum::<f64>().sqrt() * cell_m;
    let along = |place: [u32; 3]| {
        if step[2] != 0 {
            place[2]
        } else if step[0] != 0 {
            place[0]
        } else {
            place[1]
        }
    };
    let mut follow = vec![0.0; order.len()];
    for line in starts.windows(2) {
        let (first, last) = (line[0] as usize, line[1] as usize);
        let at = |i: usize| i64::from(along(places[order[i] as usize]));
        let mut before = match step {
            [1, 0, 0] => Some(at(last - 1) - nx as i64),
            [0, 1, 0] => Some(at(last - 1) - ny as i64),
            _ => None,
        };
        for (i, follow) in (first..last).zip(&mut follow[first..last]) {
            if let Some(before) = before {
                let gap = (at(i) - before - 1) as f64 * length_m / GAP_M;
                *follow = (1.0 / (1.0 + gap * gap)) as f32;
            }
            before = Some(at(i));
        }
    }
    order.iter_mut().for_each(|number| *number = slots[*number as usize]);
    Family { step, order, starts, follow }
}
