//! Particles of the air by Mie theory.

use std::f64::consts::PI;

use skyloom::optics::{Channel, Particles, Sampling};

fn particles(effective_radius_um: f64, refractive_index: [f64; 2]) -> Particles {
    Particles { effective_radius_um, broadness: 2.0, refractive_index }
}

fn at(particles: &Particles, wavelength_nm: f64) -> Channel {
    particles.optics(wavelength_nm, &|_| ()).unwrap()
}

/// Few spheres stand for all of them: many more change nothing that counts.
#[test]
fn as_many_spheres_are_enough() {
    let many = Sampling { wavelengths: 9, radii: 1600 };
    for (radius, index) in [(0.05, [1.75, 0.44]), (0.3, [1.45, 0.005]), (5.0, [1.37, 1e-6])] {
        let particles = particles(radius, index);
        let (few, many) = (at(&particles, 550.0), particles.optics_sampled(550.0, &many, &|_| ()).unwrap());
        let extinction = few.cross_section_um2 / many.cross_section_um2 - 1.0;
        let square = |(a, b): (&f64, &f64)| (a / b - 1.0).powi(2);
        let values = few.phase.grid_values();
        let squares: f64 = values.iter().zip(many.phase.grid_values()).map(square).sum();
        let rms = (squares / values.len() as f64).sqrt();
        println!("{radius} µm: extinction {extinction:.1e}, albedo {:.1e}, P {rms:.1e} rms", few.albedo - many.albedo);
        assert!(extinction.abs() < 5e-4 && rms < 5e-3 && (few.albedo - many.albedo).abs() < 1e-4);
    }
}

/// Particles far smaller than the wavelength scatter as molecules do: P = 3/4 (1 + cos²), extinction as the fourth power; their
/// absorption goes with their volume.
#[test]
fn small_particles_are_those_of_rayleigh() {
    let [clear, dark] = [[1.45, 0.0], [1.45, 0.1]].map(|index| Particles { broadness: 20.0, ..particles(0.02, index) });
    let [near, far] = [700.0, 1000.0].map(|nm| at(&clear, nm));
    let power = (near.cross_section_um2 / far.cross_section_um2).ln() / (1000.0_f64 / 700.0).ln();
    assert!((power - 4.0).abs() < 0.1, "{power}");
    assert!((near.albedo - 1.0).abs() < 1e-12 && near.asymmetry.abs() < 0.02, "{near:?}");
    for degrees in [0.0_f64, 40.0, 90.0, 150.0, 180.0] {
        let angle = degrees.to_radians();
        let exact = 0.75 * (1.0 + angle.cos().powi(2));
        assert!((near.phase.value(angle) / exact - 1.0).abs() < 0.08, "{degrees}");
    }
    // Absorption: 4 x Im((m² - 1) / (m² + 2)) of the area (C. F. Bohren and D. R. Huffman, 1983, equation 5.11).
    let absorbing = at(&dark, 1000.0);
    let (real, imaginary) = (1.45_f64.powi(2) - 0.01, 2.0 * 1.45 * 0.1);
    let part = (imaginary * (real + 2.0) - (real - 1.0) * imaginary) / ((real + 2.0).powi(2) + imaginary.powi(2));
    let absorbed = (1.0 - absorbing.albedo) * absorbing.cross_section_um2;
    // Mean of r³ over the sizes: r_n³ b (b+1) (b+2).
    let scale: f64 = 0.02 / 22.0;
    let cube = scale.powi(3) * 20.0 * 21.0 * 22.0;
    let exact = 4.0 * part * (2.0 * PI / 1.0) * PI * cube;
    assert!((absorbed / exact - 1.0).abs() < 0.02, "{absorbed}, not {exact}");
}

/// Extinction of the accumulation mode falls with the wavelength, that of coarse particles hardly changes; large particles have
/// twice their area.
#[test]
fn extinction_goes_with_the_wavelength_as_sizes_say() {
    let exponent = |particles: &Particles| {
        let [blue, red] = [445.0, 640.0].map(|nm| at(particles, nm).cross_section_um2);
        (blue / red).ln() / (640.0_f64 / 445.0).ln()
    };
    let (smallest, fine, coarse) =
        (particles(0.1, [1.45, 0.005]), particles(0.3, [1.45, 0.005]), particles(5.0, [1.37, 1e-6]));
    let found = [&smallest, &fine, &coarse].map(exponent);
    println!("exponents of wavelength: {found:.3?}");
    assert!(found[0] > 1.8 && found[0] < 3.0 && found[1] > 0.4 && found[1] < 1.6 && found[2].abs() < 0.15, "{found:?}");
    let area = PI * 2.0 * 3.0 * (5.0_f64 / 4.0).powi(2);
    let efficiency = at(&coarse, 550.0).cross_section_um2 / area;
    assert!((efficiency - 2.1).abs() < 0.1, "{efficiency}");
}

#[test]
fn what_cannot_be_computed_is_refused() {
    for wrong in [
        particles(0.01, [1.4, 0.0]),
        particles(21.0, [1.4, 0.0]),
        particles(1.0, [1.0, 0.0]),
        particles(1.0, [1.4, 1.1]),
    ] {
        let error = wrong.optics(550.0, &|_| ()).unwrap_err().to_string();
        assert!(error.contains("is not in"), "{error}");
    }
}
