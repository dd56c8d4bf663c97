//! Light that a layer of cloud scatters forwards, as the layers beyond it get it.
//!
//! Droplets turn two thirds of what they scatter by less than 25 degrees. To the next layer that light comes nearly from where it
//! came from: it goes on as the beam it was scattered out of. How small a turn counts as none depends on who looks: from a
//! direction within the 25 degrees around the sun, light that turned by more than that angle is no part of the sun's any more.

use crate::optics::Channel;

/// Light that is turned by less than this goes on as the beam that it came from, degrees. Chosen against exact stacks:
/// with less, light that is scattered twice loses its azimuth; with more, light is drawn together around the sun.
pub const FORWARD_DEG: f64 = 25.0;
/// What a view may lie nearer to the sun than the light turned, degrees: the peak itself has a width.
pub const FORWARD_MARGIN_DEG: f64 = 2.0;

/// Part of extinction that turns light by less than an angle.
pub fn forward_albedo(channel: &Channel, degrees: f64) -> f64 {
    channel.albedo * channel.phase.fraction_within(degrees.to_radians())
}

/// The same of what goes on as the sun's beam for a view at so many degrees from the sun.
pub fn forward_albedo_seen(channel: &Channel, degrees: f64) -> f64 {
    forward_albedo(channel, (degrees + FORWARD_MARGIN_DEG).min(FORWARD_DEG))
}
