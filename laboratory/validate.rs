//! `qpgen validate`: experiments 1 and 2 of the paper's section 2.2.2. A bare pixel is rendered with the ordinary
//! estimator, and the response that comes back is held against the one put in.
//!
//! 1. A white disk of 5 mm at 1 m is moved so that it is seen at (θ, φ). `E = P_id Ω cos θ` with Ω cos θ = A cos⁴θ /
//!    z².
//! 2. An endless white plane, with the response masked to one node. The paper's nodes are polar and its weights those
//!    of equation 3; our nodes lie in (u, v), where cos θ dω = du dv, so the masked node's share is exactly
//!    `N = Δu Δv` (the integral of its bilinear hat) at every angle.

use glam::{DVec2, DVec3};
use quadpixel::lens::PupilEllipse;
use quadpixel::render::{Camera, RenderSettings, render};
use quadpixel::response::{AngularResponse, Response};
use quadpixel::scene::coverage::Coverage;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::Sensor;
use quadpixel::spectrum::ChannelWavelengths;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::Arc;

use crate::error::LaboratoryError;

/// Distance (mm) and diameter (mm) of the disk of experiment 1.
const DISTANCE_MM: f64 = 1000.0;
const DISK_MM: f64 = 5.0;
/// Texels across the disk's cut-out.
const DISK_TEXELS: usize = 2048;

/// One direction, and the response of each sub-pixel put in and come back.
#[derive(Clone, Debug, Serialize)]
pub struct Probe {
    /// Angle to the axis, deg.
    pub theta_deg: f64,
    /// Azimuth, deg.
    pub phi_deg: f64,
    /// P of each sub-pixel put in (index rule of the sub-pixels).
    pub put_in: Vec<f64>,
    /// P of each sub-pixel that came back.
    pub came_back: Vec<f64>,
}

/// What an experiment says.
#[derive(Clone, Debug, Serialize)]
pub struct Experiment {
    /// RMS difference over directions and sub-pixels, as a fraction of the largest P put in.
    pub rms: f64,
    /// Largest difference, as the same fraction.
    pub maximum: f64,
    /// Every direction.
    pub probes: Vec<Probe>,
}

/// A moving disk: θ in steps of 2.5° up to `theta_max_deg`, φ in steps of 5°.
///
/// # Errors
/// A camera that cannot be made of the response.
pub fn moving_disk(
    response: &AngularResponse,
    theta_max_deg: f64,
    rays: usize,
) -> Result<Experiment, LaboratoryError> {
    let white = Texture::from_fn(1, 1, |_, _| [1.0])?;
    let white = Arc::new(white);
    let disk = Arc::new(disk()?);
    let directions: Vec<(f64, f64)> = (0..=(theta_max_deg / 2.5) as usize)
        .flat_map(|t| (0..72).map(move |p| (2.5 * t as f64, 5.0 * p as f64)))
        .filter(|d| d.0 > 0.0 || d.1 == 0.0)
        .collect();
    let whole = Response::Table(response.clone());
    let probe = |&(theta_deg, phi_deg): &(f64, f64)| {
        let (sin, cos) = phi_deg.to_radians().sin_cos();
        // Light along (u, v) comes from the other side, in the sensor frame; the camera frame's x is the sensor's −x.
        let offset = theta_deg.to_radians().tan() * DISTANCE_MM * DVec2::new(cos, -sin);
        let centre = offset.extend(-DISTANCE_MM);
        let card = TexturedPlane::new(
            centre,
            (DISK_MM, DISK_MM),
            (0.0, 0.0, 0.0),
            white.clone(),
            Some(disk.clone()),
        );
        let scene = Scene::new(vec![card?], [0.0; 3]);
        // Aimed wider than the disk: its rim is found by the rays.
        let came_back = pixel(&whole, &scene, around(centre, 0.6 * DISK_MM), rays)?;
        let cos4 = theta_deg.to_radians().cos().powi(4);
        let seen = std::f64::consts::PI * (0.5 * DISK_MM).powi(2) * cos4 / DISTANCE_MM.powi(2);
        let (u, v) = (
            theta_deg.to_radians().sin() * cos,
            theta_deg.to_radians().sin() * sin,
        );
        Ok(Probe {
            theta_deg,
            phi_deg,
            put_in: looked_up(response, u, v),
            came_back: came_back.into_iter().map(|e| e / seen).collect(),
        })
    };
    Ok(Experiment::new(
        directions
            .par_iter()
            .map(probe)
            .collect::<Result<_, LaboratoryError>>()?,
    ))
}

/// An endless white plane seen through one node of the table at a time: every `stride`-th node up to `theta_max_deg`.
///
/// # Errors
/// A camera that cannot be made of the response.
pub fn masked_plane(
    response: &AngularResponse,
    theta_max_deg: f64,
    stride: usize,
    rays: usize,
) -> Result<Experiment, LaboratoryError> {
    let (us, vs) = (&response.axes().u, &response.axes().v);
    let scene = Scene::new(Vec::new(), [1.0; 3]);
    let limit = theta_max_deg.to_radians().sin();
    let middle = |n: usize| (n / 2) % stride;
    let nodes: Vec<(usize, usize)> = (1..vs.len() - 1)
        .filter(|i| i % stride == middle(vs.len()))
        .flat_map(|iv| {
            (1..us.len() - 1)
                .filter(|i| i % stride == middle(us.len()))
                .map(move |iu| (iv, iu))
        })
        .filter(|&(iv, iu)| us[iu].hypot(vs[iv]) <= limit)
        .collect();
    let probe = |&(iv, iu): &(usize, usize)| {
        let (u, v) = (us[iu], vs[iv]);
        let (du, dv) = (us[iu + 1] - u, vs[iv + 1] - v);
        let masked = masked_to_node(response, iv, iu)?;
        // Where light with these direction cosines comes from, on a plane 1 mm away, camera frame.
        let source = |u: f64, v: f64| DVec2::new(u, -v) / (1.0 - u * u - v * v).max(1e-3).sqrt();
        let corners =
            [(-du, -dv), (du, -dv), (-du, dv), (du, dv)].map(|(a, b)| source(u + a, v + b));
        let centre = source(u, v);
        let radius = corners
            .iter()
            .map(|c| c.distance(centre))
            .fold(0.0, f64::max)
            * 1.05;
        let back = pixel(
            &Response::Table(masked),
            &scene,
            around(centre.extend(-1.0), radius),
            rays,
        )?;
        Ok(Probe {
            theta_deg: u.hypot(v).asin().to_degrees(),
            phi_deg: v.atan2(u).to_degrees().rem_euclid(360.0),
            put_in: response
                .node(0, 0, iv, iu)
                .iter()
                .map(|&p| f64::from(p))
                .collect(),
            came_back: back.into_iter().map(|e| e / (du * dv)).collect(),
        })
    };
    Ok(Experiment::new(
        nodes
            .par_iter()
            .map(probe)
            .collect::<Result<_, LaboratoryError>>()?,
    ))
}

/// The table with every value 0 but those of one node.
fn masked_to_node(
    response: &AngularResponse,
    iv: usize,
    iu: usize,
) -> Result<AngularResponse, LaboratoryError> {
    let n_sub = response.subpixels().count();
    let mut table = vec![0.0; response.table().len()];
    let at = (iv * response.axes().u.len() + iu) * n_sub;
    table[at..at + n_sub].copy_from_slice(response.node(0, 0, iv, iu));
    let (axes, meta) = (response.axes().clone(), response.meta().clone());
    Ok(AngularResponse::new(axes, meta, table)?)
}

/// Green irradiance of each sub-pixel of one bare pixel, sr.
fn pixel(
    response: &Response,
    scene: &Scene,
    target: PupilEllipse,
    rays: usize,
) -> Result<Vec<f64>, LaboratoryError> {
    let sensor = Sensor::new(
        response.pitch_um(),
        response.subpixels(),
        (1, 1),
        DVec2::ZERO,
    )?;
    let camera = Camera::bare(sensor, response, ChannelWavelengths::default(), target)?;
    let settings = RenderSettings {
        rays_per_pixel: rays,
        seed: 1,
    };
    let rendered = render(&camera, scene, &settings);
    Ok(rendered
        .image
        .mosaic
        .data()
        .chunks_exact(3)
        .map(|rgb| f64::from(rgb[ChannelWavelengths::REFERENCE]))
        .collect())
}

/// A disk to aim at, square to the axis.
fn around(centre_mm: DVec3, radius_mm: f64) -> PupilEllipse {
    PupilEllipse {
        centre_mm,
        axis_a_mm: DVec2::X * radius_mm,
        axis_b_mm: DVec2::Y * radius_mm,
    }
}

fn looked_up(response: &AngularResponse, u: f64, v: f64) -> Vec<f64> {
    let mut p = vec![0.0; response.subpixels().count()];
    let wavelength = ChannelWavelengths::default().reference_nm();
    response
        .interpolator(wavelength)
        .weights(u as f32, v as f32, &mut p);
    p.into_iter().map(f64::from).collect()
}

fn disk() -> Result<Coverage, LaboratoryError> {
    let at = |i: usize| (i as f64 + 0.5) / DISK_TEXELS as f64 - 0.5;
    let inside = |k: usize| u8::from(at(k % DISK_TEXELS).hypot(at(k / DISK_TEXELS)) <= 0.5);
    let texels = (0..DISK_TEXELS * DISK_TEXELS).map(inside).collect();
    Ok(Coverage::new(DISK_TEXELS, texels)?)
}

impl Experiment {
    fn new(probes: Vec<Probe>) -> Self {
        let peak = probes
            .iter()
            .flat_map(|p| &p.put_in)
            .fold(0.0, |a: f64, &b| a.max(b));
        let differences = probes
            .iter()
            .flat_map(|p| p.put_in.iter().zip(&p.came_back))
            .map(|(a, b)| (a - b).abs() / peak);
        let (n, squares, maximum) = differences.fold((0, 0.0, 0.0), |(n, s, m), d| {
            (n + 1, s + d * d, f64::max(m, d))
        });
        Self {
            rms: (squares / f64::from(n.max(1))).sqrt(),
            maximum,
            probes,
        }
    }
}
