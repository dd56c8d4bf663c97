//! Light that a layer of cloud scatters forwards, as the layers beyond it get it.
//!
//! Droplets turn two thirds of what they scatter by less than 25 degrees. To the next layer that light comes nearly from where it
//! came from: it goes on as the beam it was scattered out of.

use crate::optics::Channel;

/// Light that is turned by less than this goes on as the beam that it came from, degrees. Chosen against exact stacks:
/// with less, light that is scattered twice loses its azimuth; with more, light is drawn together around the sun.
pub const FORWARD_DEG: f64 = 25.0;

/// Part of extinction that turns light by less than an angle.
pub fn forward_albedo(channel: &Channel, degrees: f64) -> f64 {
    channel.albedo * channel.phase.fraction_within(degrees.to_radians())
}
