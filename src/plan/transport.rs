//! Which transport carries sunlight through uneven cloud where none is asked for: by errors that were measured
//! (docs/charts/light.csv), for what is looked at and the kind of field. Neither sun nor time has a say, so that no film
//! changes from one to the other.

use crate::field;
use crate::method::{Told, Transport};
use crate::projection::{Plane, Side, Viewer};
use crate::request::Request;
use crate::scene::{Edge, Layer, Scene, Shape, Thickness};

/// Those that a plan takes, cheapest first. Tilted rays save a tenth of the stage, a fiftieth of a frame, and err by up to 1.6 times as much as the
/// blend under single suns; entry costs what the blend does and is nowhere better; the lattice takes some tenths of a second for a new sun or
/// field over 20 km, ten times as long as the others: it is taken for what an eye sees and for columns that eddies do not change, and
/// left to those who ask for it elsewhere.
const PLANNED: [Transport; 3] = [Transport::Columns, Transport::Blended, Transport::Lattice];
/// Where none is within the tolerance, so many times the least error are as good.
const NEAR: f64 = 1.3;

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
    Near,
}

/// What maps tell of a layer whose columns have optical depths of their own.
fn told_of(shape: &Shape) -> Option<Told> {
    shape.optical_depth.as_ref()?;
    let uneven = matches!(shape.thickness, Some(Thickness::Stratocumulus(_) | Thickness::Map { .. }));
    let [base, top] = [matches!(shape.base, Edge::Map(_)), matches!(shape.top, Edge::Map(_))];
    let based = base || (uneven && matches!(shape.base, Edge::Open));
    let topped = top || uneven || matches!(shape.top, Edge::Flat(_));
    Some(match (based && topped, base || top || uneven) {
        (true, _) => Told::Shapes,
        (false, true) => Told::Heights,
        (false, false) => Told::Depths,
    })
}

/// Layers that are not the same everywhere.
fn uneven(scene: &Scene) -> impl Iterator<Item = &Layer> {
    scene.layers.iter().filter(|layer| !layer.shape.is_even())
}

/// The least that is told of all uneven layers, if something is told of each.
fn told(scene: &Scene) -> Option<Told> {
    uneven(scene).map(|layer| told_of(&layer.shape)).min().flatten()
}

/// Error of a transport in what is looked at of a scene.
pub(super) fn error(transport: Transport, scene: &Scene, looked: Looked) -> f64 {
    if let Some(told) = told(scene) {
        let [flux, below, above] = transport.format_errors(told);
        return match looked {
            Looked::Ground => flux,
            Looked::Clouds(Side::Below) | Looked::Eye(Side::Below) => below,
            Looked::Clouds(Side::Above) | Looked::Eye(Side::Above) => above,
            Looked::Sky => below.max(above),
        };
    }
    let of_side = |side| transport.radiance_error(side, scene.layers.iter().any(|layer| layer.shape.may_have_gaps()));
    match looked {
        Looked::Ground => transport.error(),
        Looked::Clouds(side) | Looked::Eye(side) => of_side(side),
        Looked::Sky => of_side(Side::Below).max(of_side(Side::Above)),
    }
}

fn choose(tolerance: f64, scene: &Scene, looked: Looked) -> (Transport, Reason) {
    let is_uneven = uneven(scene).next().is_some();
    let solved = is_uneven
        && match looked {
            Looked::Sky | Looked::Eye(_) => true,
            Looked::Clouds(_) => {
                uneven(scene).all(|layer| layer.shape.is_deep_below() && !field::moves(&layer.shape, &layer.wind))
            }
            Looked::Ground => told(scene).is_some(),
        };
    if !solved && is_uneven && uneven(scene).all(|layer| layer.shape.is_deep_below()) {
        return (Transport::Columns, Reason::DeepBelow);
    }
    let planned = &PLANNED[..PLANNED.len() - usize::from(!solved)];
    let error = |transport: Transport| error(transport, scene, looked);
    let of = |enough: &dyn Fn(Transport) -> bool| planned.iter().copied().find(|transport| enough(*transport));
    if let Some(cheapest) = of(&|transport| error(transport) <= tolerance) {
        return (cheapest, Reason::Within);
    }
    let least = planned.iter().map(|transport| error(*transport)).fold(f64::MAX, f64::min);
    // Columns lose half of the light of a low sun among broken clouds: a pattern that is hardly worse does not make up for that.
    let near =
        |transport: Transport| error(transport) <= if transport == Transport::Columns { least } else { NEAR * least };
    (of(&near).unwrap_or(Transport::Columns), Reason::Near)
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
        (Transport::Lattice, Reason::Near) => {
            "sunlight through uneven cloud, solved in three dimensions; cheaper methods err by more than 1.3 times as much"
        }
        (_, Reason::Near) => {
            "sunlight through uneven cloud; none is within the tolerance, and no method for every frame is 1.3 times as exact in such cloud"
        }
    }
}
