//! Which transport carries sunlight through uneven cloud where none is asked for: by errors that were measured
//! (docs/charts/light.csv), for what is looked at and the kind of field. Neither sun nor time has a say, so that no film
//! changes from one to the other.

use crate::method::Transport;
use crate::projection::Side;
use crate::scene::Scene;

/// Those that a plan takes, cheapest first. Entry costs what the blend does and is nowhere better; the lattice takes about a second
/// for a new sun over 20 km, more than ten times as long as the others, and is left to those who ask for it.
const PLANNED: [Transport; 3] = [Transport::Columns, Transport::Tilted, Transport::Blended];

/// Why a transport was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reason {
    /// Layers whose tops do not tell how deep they are show no bright and dark sides, which all but independent columns give them
    /// (docs/method.md 5.3).
    DeepBelow,
    Within,
    Least,
}

/// Error of a transport in what is seen of a scene, from a side; or in light on the ground.
pub(super) fn error(transport: Transport, scene: &Scene, side: Option<Side>) -> f64 {
    match side {
        Some(side) => transport.radiance_error(side, scene.layers.iter().any(|layer| layer.shape.may_have_gaps())),
        None => transport.error(),
    }
}

fn choose(tolerance: f64, scene: &Scene, side: Option<Side>) -> (Transport, Reason) {
    let mut uneven = scene.layers.iter().filter(|layer| !layer.shape.is_even()).peekable();
    if uneven.peek().is_some() && uneven.all(|layer| layer.shape.is_deep_below()) {
        return (Transport::Columns, Reason::DeepBelow);
    }
    let error = |transport: &Transport| error(*transport, scene, side);
    if let Some(cheapest) = PLANNED.into_iter().find(|transport| error(transport) <= tolerance) {
        return (cheapest, Reason::Within);
    }
    // Of equals the last: light that `irradiance` takes is not made a second time.
    let least = PLANNED.into_iter().rev().min_by(|a, b| error(a).total_cmp(&error(b)));
    (least.unwrap_or(Transport::Columns), Reason::Least)
}

/// The transport of a plan.
pub(super) fn planned(tolerance: f64, scene: &Scene, side: Option<Side>) -> Transport {
    choose(tolerance, scene, side).0
}

/// Why it is that one, in words.
pub(super) fn reason(tolerance: f64, scene: &Scene, side: Option<Side>) -> &'static str {
    match choose(tolerance, scene, side).1 {
        Reason::DeepBelow => "sunlight through cloud whose top does not tell how deep it is",
        Reason::Within => "sunlight through uneven cloud; the cheapest within the tolerance",
        Reason::Least => "sunlight through uneven cloud; no method for every frame errs less in such cloud",
    }
}
