//! The channels of a texture, each by itself.

use super::pixels::{Pixels, error_name};

/// What a channel holds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Light, or what a texture of one channel has instead.
    Light,
    Alpha,
    /// Standard errors.
    Errors,
}

/// A channel of the file: every `step`th value of the data from the place on.
pub(super) struct Channel<'a> {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) data: &'a [f32],
    pub(super) place: usize,
    pub(super) step: usize,
}

/// Channels in the order of their names, as the file has them.
pub(super) fn channels<'a>(pixels: &Pixels<'a>) -> Vec<Channel<'a>> {
    let (step, lit) = (pixels.channels.len(), pixels.lit());
    let mut channels = Vec::with_capacity(step + lit);
    for (place, &name) in pixels.channels.iter().enumerate() {
        let kind = if place < lit { Kind::Light } else { Kind::Alpha };
        channels.push(Channel { name: name.to_owned(), kind, data: pixels.data, place, step });
        if let (Some(data), Kind::Light) = (pixels.errors, kind) {
            channels.push(Channel { name: error_name(name), kind: Kind::Errors, data, place, step: lit });
        }
    }
    for layer in pixels.layers {
        for (place, &name) in pixels.channels.iter().take(lit).enumerate() {
            let (name, step) = (layer.channel(name), lit);
            let errors = error_name(&name);
            channels.push(Channel { name, kind: Kind::Light, data: &layer.data, place, step });
            channels.push(Channel { name: errors, kind: Kind::Errors, data: &layer.standard_error, place, step });
        }
    }
    channels.sort_unstable_by(|one, other| one.name.cmp(&other.name));
    channels
}
