//! Which transport carries sunlight through uneven cloud where none is asked for: by errors that were measured
//! (docs/charts/light.csv), for what is looked at and the kind of field. Neither sun nor time has a say, so that no film
//! changes from one to the other.

use crate::method::Transport;
use crate::projection::{Plane, Side, Viewer};
use crate::request::Request;
use crate::scene::Scene;

/// Those that a plan takes, cheapest first. Entry costs what the blend does and is nowhere better; the lattice takes some tenths of a second
/// for a new sun or field over 20 km, ten times as long as the others: it is taken for what an eye sees, and left to those who ask
/// for it elsewhere.
const PLANNED: [Transport; 4] = [Transport::Columns, Transport::Tilted, Transport::Blended, Transport::Lattice];

/// What is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Looked {
    /// Light on the ground.
    Ground,
    /// A parallel view of clouds from one side.
    Clouds(Side),
    /// A view of clouds on one side of an eye: what a sky shows there.
    Eye(Side),
    /// A sky: clouds from below, from above or both.
    Sky,
}

impl Looked {
    pub(super) fn of(request: &Request) -> Self {
        let wanted = &request.wanted;
        match wanted.plane() {
            Some(Plane { side, viewer: Viewer::At(_) }) => Self::Eye(*side),
            Some(plane) => Self::Clouds(plane.side),
            None if wanted.sphere().is_some() => Self::Sky,
            None => Self::Ground,
        }
    }
}

/// Why a transport was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reason {
    /// Layers whose tops do not tell how deep they are show no bright and dark sides, which all but independent columns and the lattice give
    /// them (docs/method.md 5.3).
    DeepBelow,
    Within,
    Least,
}

/// Error of a transport in what is looked at of a scene.
pub(super) fn error(transport: Transport, scene: &Scene, looked: Looked) -> f64 {
    let of_side = |side| transport.radiance_error(side, scene.layers.iter().any(|layer| layer.shape.may_have_gaps()));
    match looked {
        Looked::Ground => transport.error(),
        Looked::Clouds(side) | Looked::Eye(side) => of_side(side),
        Looked::Sky => of_side(Side::Below).max(of_side(Side::Above)),
    }
}

fn choose(tolerance: f64, scene: &Scene, looked: Looked) -> (Transport, Reason) {
    let mut uneven = scene.layers.iter().filter(|layer| !layer.shape.is_even()).peekable();
    let solved = matches!(looked, Looked::Sky | Looked::Eye(_)) && uneven.peek().is_some();
    if !solved && uneven.peek().is_some() && uneven.all(|layer| layer.shape.is_deep_below()) {
        return (Transport::Columns, Reason::DeepBelow);
    }
    let planned = &PLANNED[..PLANNED.len() - usize::from(!solved)];
    let error = |transport: &&Transport| error(**transport, scene, looked);
    if let Some(cheapest) = planned.iter().find(|transport| error(transport) <= tolerance) {
        return (*cheapest, Reason::Within);
    }
    // Of equals the last: light that `irradiance` takes is not made a second time.
    let least = planned.iter().rev().min_by(|a, b| error(a).total_cmp(&error(b)));
    (least.copied().unwrap_or(Transport::Columns), Reason::Least)
}

/// The transport of a plan.
pub(super) fn planned(tolerance: f64, scene: &Scene, looked: Looked) -> Transport {
    choose(tolerance, scene, looked).0
}

/// Why it is that one, in words.
pub(super) fn reason(tolerance: f64, scene: &Scene, looked: Looked) -> &'static str {
    match choose(tolerance, scene, looked) {
        (_, Reason::DeepBelow) => "sunlight through cloud whose top does not tell how deep it is",
        (_, Reason::Within) => "sunlight through uneven cloud; the cheapest within the tolerance",
        (Transport::Lattice, Reason::Least) => {
            "sunlight through uneven cloud, solved in three dimensions; cheaper methods err twice as much or more"
        }
        (_, Reason::Least) => "sunlight through uneven cloud; no method for every frame errs less in such cloud",
    }
}
