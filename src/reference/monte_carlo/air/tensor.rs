//! What light at the end of a path is worth at the eye, by its polarisation.

use glam::{DMat3, DVec3};

/// A symmetric tensor A: light with the coherency tensor C (transverse, its trace the radiance) adds tr(A C) to the
/// radiance at the eye. It is transverse to the path's last direction, and its trace is twice the worth of unpolarised
/// light.
///
/// A dipole scatters C into the direction v as `3/(8 pi) P C P`, P = 1 - v v^T the projection across v (Lord Rayleigh,
/// 1871); a path against the light projects A the same way.
#[derive(Clone, Copy, Debug)]
pub(in crate::reference::monte_carlo) struct Tensor(DMat3);

impl Tensor {
    /// Light is worth the same whatever its polarisation.
    pub(in crate::reference::monte_carlo) fn unpolarised(direction: DVec3, worth: f64) -> Self {
        Self((DMat3::IDENTITY - outer(direction, direction)) * worth)
    }

    /// Worth of unpolarised light from the path's direction.
    pub(in crate::reference::monte_carlo) fn worth(&self) -> f64 {
        self.trace() / 2.0
    }

    fn trace(&self) -> f64 {
        self.0.x_axis.x + self.0.y_axis.y + self.0.z_axis.z
    }

    /// Trace of the projection across a direction: at most [`Self::trace`], which the worst case needs.
    pub(in crate::reference::monte_carlo) fn across(&self, direction: DVec3) -> f64 {
        self.trace() - direction.dot(self.0 * direction)
    }

    /// How near to its maximum, 0 to 1, the light of dipoles is that comes from a direction.
    pub(in crate::reference::monte_carlo) fn dipole_part(&self, direction: DVec3) -> f64 {
        self.across(direction) / self.trace()
    }

    /// After scattering by a dipole of light from `direction`, which was drawn in proportion to [`Self::across`].
    pub(in crate::reference::monte_carlo) fn through_dipole(&self, direction: DVec3) -> Self {
        let seen = self.0 * direction;
        let lengthwise = direction.dot(seen);
        let projected =
            self.0 - outer(seen, direction) - outer(direction, seen) + outer(direction, direction) * lengthwise;
        Self(projected * (self.trace() / (self.trace() - lengthwise)))
    }

    pub(in crate::reference::monte_carlo) fn times(&self, factor: f64) -> Self {
        Self(self.0 * factor)
    }
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

#[cfg(test)]
mod tests {
    use super::{DVec3, Tensor};

    #[test]
    fn dipoles_scatter_unpolarised_light_as_rayleigh_found() {
        let eye = Tensor::unpolarised(DVec3::Z, 1.0);
        assert!((eye.worth() - 1.0).abs() < 1e-15);
        for degrees in [0.0_f64, 30.0, 54.0, 90.0, 130.0, 180.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let sun = DVec3::new(0.6 * sin, 0.8 * sin, cos);
            assert!((eye.across(sun) - (1.0 + cos * cos)).abs() < 1e-14);
            let after = eye.through_dipole(sun);
            assert!((after.worth() - 1.0).abs() < 1e-14 && (after.across(sun) - 2.0).abs() < 1e-14);
        }
        // Scattered by 90 degrees twice in one plane: light that was polarised across it stays, the other is lost.
        let twice = eye.through_dipole(DVec3::X);
        assert!(twice.dipole_part(DVec3::Y) < 1e-14 && (twice.dipole_part(DVec3::Z) - 1.0).abs() < 1e-14);
    }
}
