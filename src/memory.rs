//! What a texture takes of memory, told before anything is made: so that what would not fit is refused, and no device runs out.
//!
//! Counted is what a render holds at a time on the device and on the host together, its file in memory too: on a software device they are one
//! memory. What stays to the end adds up, what a stage takes for itself counts where it is most. Neither the sun nor the time has a
//! say, so that no frame of a film is refused that its first one was not. Left out are the program itself with its compiled shaders
//! (about 260 MB with a software driver), what a renderer keeps of earlier requests, and tables in the making.
//!
//! Numbers are those of the types that the stages allocate; where it depends on the clouds how much that is (cubes of a lattice that hold
//! some), they are measured. `tests/memory.rs` compares the whole with what a process takes.

mod clouds;
mod droplets;
mod heights;
mod light;
mod shown;
mod tally;

use crate::field::{FieldBytes, moves};
use crate::job::Images;
use crate::plan::{Plan, field_resolution};
use crate::request::Request;
use crate::scene::Scene;
use clouds::{cumulus, fields, lattices, tables};
use light::light;
use shown::{levels, shown};
use tally::Tally;

/// What a request takes of memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory {
    /// Bytes at a time, at most.
    pub bytes: u64,
    /// The stage that takes most of them, in words.
    pub most: &'static str,
}

impl Memory {
    /// That of a request in its normal form ([`Request::of`]). An image that is not among `images` counts as one texel.
    pub fn new(request: &Request, scene: &Scene, images: &Images) -> Self {
        let plan = Plan::new(request, scene);
        let mut tally = Tally::default();
        let mut maps = Vec::new();
        if request.texture().shows_the_scene() {
            let resolution = field_resolution(scene, request);
            let of = |layer| FieldBytes::new(layer, moves(&layer.shape, &layer.wind), resolution, images);
            maps.extend(scene.layers.iter().map(of));
            tables(&mut tally, scene, request, &plan, images);
            fields(&mut tally, &maps, plan.reference.is_some());
            if plan.reference.is_none() {
                lattices(&mut tally, scene, request, &plan, &maps, images);
                light(&mut tally, scene, request, &plan, &maps, images);
                cumulus(&mut tally, scene, request, &plan, &maps);
                levels(&mut tally, request, &maps);
            }
        }
        shown(&mut tally, scene, request, &plan, &maps, images);
        Self { bytes: tally.peak(), most: tally.most() }
    }

    /// Texels a side, at most, of the same request with which it takes no more than so many bytes; `None` where no size does.
    pub fn largest_size(request: &Request, scene: &Scene, images: &Images, bytes: u64) -> Option<u32> {
        let fits = |size: u32| Self::new(&Request { size: Some(size), ..*request }, scene, images).bytes <= bytes;
        let (mut low, mut high) = (0, request.size.unwrap_or(scene.resolution()));
        while low < high {
            let middle = (low + high).div_ceil(2);
            if fits(middle) { low = middle } else { high = middle - 1 }
        }
        Some(low).filter(|size| *size > 0)
    }
}
