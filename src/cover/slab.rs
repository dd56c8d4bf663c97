//! A layer as it acts in the mean over its area.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::contents::Contents;
use super::grid::INCIDENT;
use crate::atmosphere::COSINES;
use crate::slab::doubling::{Directions, Outgoing, Problem};

/// log2 of the optical depth with which the doubling starts: its error is `(depth / mu)^2 / 12`, 1e-3 at the lowest sun.
const FIRST_LOG2_DEPTH: f64 = -12.0;

/// Mean reflection and transmission functions of a layer. Each of its columns is homogeneous, so both faces are alike.
#[derive(Clone, Debug)]
pub struct MeanSlab {
    /// Reflection function: outgoing cosine by direction of incidence.
    pub reflection: DMatrix<f64>,
    /// Diffuse transmission function likewise.
    pub transmission: DMatrix<f64>,
    /// Unscattered transmittance by direction of incidence; the forward peak that the streams cannot carry counts as such.
    pub direct: Vec<f64>,
    /// Weights (sum 1) and true optical depths of the columns.
    pub columns: Vec<(f64, f64)>,
}

impl MeanSlab {
    /// Solves columns of given weights (sum 1).
    #[must_use]
    pub fn new(columns: &[(f64, Contents)], directions: &Directions) -> Self {
        let empty = || Self {
            reflection: DMatrix::zeros(COSINES, INCIDENT),
            transmission: DMatrix::zeros(COSINES, INCIDENT),
            direct: vec![0.0; INCIDENT],
            columns: columns.iter().map(|(weight, contents)| (*weight, contents.depth)).collect(),
        };
        let parts: Vec<_> = columns.par_iter().map(|(_, contents)| solved(contents, directions)).collect();
        let mut mean = empty();
        for ((weight, _), part) in columns.iter().zip(parts) {
            match part {
                Some(slab) => {
                    mean.reflection += *weight * slab.reflection;
                    mean.transmission += *weight * slab.transmission;
                    for (mean, lost) in mean.direct.iter_mut().zip(&slab.extinguished) {
                        *mean += weight * (1.0 - lost);
                    }
                }
                None => mean.direct.iter_mut().for_each(|mean| *mean += weight),
            }
        }
        mean
    }

    /// Share of a beam that passes without meeting anything.
    #[must_use]
    pub fn unscattered(&self, cosine: f64) -> f64 {
        self.columns.iter().map(|(weight, depth)| weight * (-depth / cosine).exp()).sum()
    }
}

/// One column; `None` where it is empty.
fn solved(contents: &Contents, directions: &Directions) -> Option<crate::slab::doubling::Slab> {
    let medium = contents.medium()?;
    let depth = contents.depth * medium.depth_scale;
    let doublings = (depth.log2() - FIRST_LOG2_DEPTH).ceil().max(0.0);
    let problem = Problem::new(&medium, 0, directions, Outgoing::Quadrature);
    let mut last = None;
    problem.ladder(depth * (-doublings).exp2(), doublings as usize, |k, slab| {
        if k == doublings as usize {
            last = Some(slab.clone());
        }
    });
    last
}
