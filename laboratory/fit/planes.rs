//! From pictures of a textured plane to its shifts over the picture.

use std::path::Path;

use quadpixel::image::srgb::to_linear;
use quadpixel::image::{Image, channel, raster};

use super::capture::{CaptureDescription, PlanePart};
use super::error::FitError;
use super::measurements::{PlaneBlock, PlaneShifts};
use crate::plane_shift::block_shifts;

/// Windows over the picture, columns and rows.
const GRID: [usize; 2] = [6, 3];
/// Smallest side of a picture, px: windows keep away from its edge.
const LEAST_PX: usize = 192;
/// What a shift is known to at best: parts of it, by the texture's spectrum, which the model takes for that of natural
/// pictures, and px, by what a camera's views are registered to.
const TEXTURE_PART: f64 = 0.02;
const FLOOR_PX: f64 = 0.01;
/// Views whose shift has the wrong sign by so many of its standard deviations are in the wrong order.
const EXCHANGED_SIGMAS: f64 = 4.0;

impl CaptureDescription {
    /// Shifts of the planes, whose files stand beside `folder`.
    ///
    /// # Errors
    /// Files that cannot be used; views in the wrong order.
    pub(super) fn plane_shifts(&self, folder: &Path) -> Result<Vec<PlaneShifts>, FitError> {
        self.planes
            .iter()
            .map(|plane| self.plane_of(folder, plane))
            .collect()
    }

    fn plane_of(&self, folder: &Path, part: &PlanePart) -> Result<PlaneShifts, FitError> {
        let (windows, named) = match (&part.left, &part.right) {
            (Some(left), Some(right)) => (self.found(folder, part, [left, right])?, left.as_str()),
            _ => (given(part), ""),
        };
        let nm = part.wavelength_nm.unwrap_or(self.camera.wavelength_nm);
        let plane = PlaneShifts {
            distance_mm: part.distance_mm,
            stop: part.f_number.unwrap_or(self.camera.f_number) / self.camera.f_number,
            wavelength_nm: nm,
            held_out: part.held_out || nm != self.camera.wavelength_nm,
            width_mm: windows.width_mm,
            window_px: windows.side_px,
            blocks: windows.blocks,
        };
        match is_exchanged(&plane, self.camera.focus_mm.unwrap_or(f64::NAN)) {
            false => Ok(plane),
            true => {
                let what = format!(
                    "the shift of the plane at {} mm is that of one on the other side of the focus; allowed: the views in \
                     their order, distances and focus in mm from the sensor",
                    part.distance_mm
                );
                Err(FitError::capture(folder.join(named), what))
            }
        }
    }

    /// Shifts found in windows of both views.
    fn found(
        &self,
        folder: &Path,
        part: &PlanePart,
        [left_name, right_name]: [&String; 2],
    ) -> Result<Windows, FitError> {
        let [left, right] = [left_name, right_name].map(|name| self.plane_view(folder, part, name));
        let (left, right) = (left?, right?);
        let size = |image: &Image| [image.width(), image.height()];
        let ([w, h], [other_w, other_h]) = (size(&left), size(&right));
        if [w, h] != [other_w, other_h] || w.min(h) < LEAST_PX {
            let what = format!(
                "{other_w} × {other_h} px, and the left picture is {w} × {h} px; allowed: the same size, {LEAST_PX} px \
                 or more each way"
            );
            return Err(FitError::capture(folder.join(right_name), what));
        }
        let found = block_shifts(&left, &right, GRID);
        let blocks: Vec<PlaneBlock> = (found.iter())
            .map(|block| PlaneBlock {
                place_mm: block.place_px.map(|c| 1e-3 * c * self.views.pixel_um),
                shift_px: block.shift_px,
                sigma_px: [block.sigma_px, TEXTURE_PART * block.shift_px, FLOOR_PX]
                    .iter()
                    .fold(0.0, |a: f64, b| a.hypot(*b)),
            })
            .collect();
        if blocks.is_empty() {
            let what = "no shift is found in any window; allowed: a plane with texture everywhere";
            return Err(FitError::capture(folder.join(left_name), what));
        }
        Ok(Windows {
            width_mm: 1e-3 * w as f64 * self.views.pixel_um,
            side_px: (w as f64 / GRID[0] as f64).min(h as f64 / GRID[1] as f64),
            blocks,
        })
    }

    /// Linear light of one channel.
    fn plane_view(&self, folder: &Path, part: &PlanePart, name: &str) -> Result<Image, FitError> {
        if !part.srgb {
            return self.linear(folder, name, 0.01);
        }
        let path = folder.join(name);
        let image = raster::read(&path)?;
        let mut image = match image.channels() {
            1 => image,
            3 => channel(&image, part.channel as usize),
            n => {
                let what = format!("{n} channels; allowed: grey or RGB");
                return Err(FitError::capture(path, what));
            }
        };
        image.data_mut().iter_mut().for_each(|v| *v = to_linear(*v));
        Ok(image)
    }
}

/// Shifts over a picture.
struct Windows {
    /// Width of the picture, mm on the sensor.
    width_mm: f64,
    /// Of a window.
    side_px: f64,
    blocks: Vec<PlaneBlock>,
}

/// Shifts that the description has itself; the picture reaches as far as they do.
fn given(part: &PlanePart) -> Windows {
    let block = |&[x_mm, y_mm, shift_px, sigma_px]: &[f64; 4]| PlaneBlock {
        place_mm: [x_mm, y_mm],
        shift_px,
        sigma_px,
    };
    let farthest_mm = part.shifts.iter().fold(0.0, |a: f64, s| a.max(s[0].abs()));
    Windows {
        width_mm: 2.0 * farthest_mm,
        side_px: part.window_px,
        blocks: part.shifts.iter().map(block).collect(),
    }
}

/// Whether the sign of the mean shift says so.
fn is_exchanged(plane: &PlaneShifts, focus_mm: f64) -> bool {
    let (mut sum, mut weights) = (0.0, 0.0);
    for block in &plane.blocks {
        let weight = block.sigma_px.powi(-2);
        sum += weight * block.shift_px;
        weights += weight;
    }
    let expected = if plane.distance_mm < focus_mm {
        1.0
    } else {
        -1.0
    };
    // A focus that is stated wrongly by its prior's deviation changes no more than the sign near it.
    let is_near_focus = (plane.distance_mm / focus_mm - 1.0).abs() < 0.1;
    !is_near_focus && expected * sum / weights < -EXCHANGED_SIGMAS / weights.sqrt()
}
