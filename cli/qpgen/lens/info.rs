//! The table of one lens.

use std::fmt::Write;

use quadpixel::lens::Field;
use quadpixel::lens::FieldFigures;
use quadpixel::lens::{Lens, LensError, Paraxial};
use quadpixel::range::short;
use quadpixel::units::D_LINE_NM;
use serde_json::{Value, json};

/// Everything that `qpgen lens info` says, at the d line.
pub(super) struct Info {
    lens: Lens,
    paraxial: Paraxial,
    fields: Vec<(FieldFigures, Option<f64>)>,
}

impl Info {
    /// Gathers it over the field angles.
    ///
    /// # Errors
    /// [`LensError::Value`] for a field outside 0 to 90 degrees.
    pub fn new(lens: &Lens, fields_deg: &[f64]) -> Result<Info, LensError> {
        let figures = |&angle: &f64| {
            let field = Field::up(angle);
            let light = lens.relative_illumination(field, D_LINE_NM)?;
            Ok((lens.field_figures(field)?, light))
        };
        Ok(Info {
            lens: lens.clone(),
            paraxial: lens.paraxial(D_LINE_NM)?,
            fields: fields_deg
                .iter()
                .map(figures)
                .collect::<Result<_, LensError>>()?,
        })
    }

    /// As a table to read.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = self.write_head(&mut text);
        let _ = self.write_surfaces(&mut text);
        let _ = self.write_fields(&mut text);
        text
    }

    fn write_head(&self, out: &mut String) -> std::fmt::Result {
        let (p, lens) = (&self.paraxial, self.lens.prescription());
        writeln!(out, "{}\n{}\n", lens.title(), lens.source)?;
        writeln!(out, "EFL            {:>10} mm", fixed(p.efl_mm, 4))?;
        writeln!(out, "BFL            {:>10} mm", fixed(p.bfl_mm, 4))?;
        writeln!(out, "F-number       {:>10}", fixed(p.f_number, 4))?;
        let pupil = |z: f64, semi: f64| {
            let (z, diameter) = (fixed(z, 4), fixed(2.0 * semi, 4));
            format!("z {z:>10} mm, diameter {diameter:>9} mm")
        };
        let entrance = pupil(p.entrance_pupil_z_mm, p.entrance_pupil_semi_mm);
        writeln!(out, "entrance pupil {entrance}")?;
        let exit = pupil(p.exit_pupil_z_mm, p.exit_pupil_semi_mm);
        writeln!(out, "exit pupil     {exit}")?;
        let (sensor, focus) = (self.lens.sensor_z_mm(), self.lens.focus_distance_mm());
        let (sensor, focus) = (fixed(sensor, 4), short(&focus));
        writeln!(out, "sensor         z {sensor:>10} mm, focus at {focus} mm")?;
        if let Some(z_mm) = lens.fold_z_mm() {
            writeln!(
                out,
                "fold mirror    z {:>10} mm (unfolded here)",
                fixed(z_mm, 4)
            )?;
        }
        if !lens.is_dispersive() {
            writeln!(
                out,
                "no Abbe numbers: the lens is the same at every wavelength"
            )?;
        }
        Ok(())
    }

    fn write_surfaces(&self, out: &mut String) -> std::fmt::Result {
        let lens = self.lens.prescription();
        writeln!(
            out,
            "\n  #   radius mm  thickness mm       nd      vd      conic  semi mm  terms  label"
        )?;
        for (i, s) in lens.surfaces.iter().enumerate() {
            let radius = if s.curvature == 0.0 {
                "plane".into()
            } else {
                fixed(1.0 / s.curvature, 5)
            };
            let (nd, vd) = match s.glass.map(|g| g.nd_vd()) {
                None => (String::new(), String::new()),
                Some((nd, vd)) if vd.is_finite() => (format!("{nd:.5}"), format!("{vd:.2}")),
                Some((nd, _)) => (format!("{nd:.5}"), "-".into()),
            };
            let terms = s.aspheric.iter().filter(|&&a| a != 0.0).count();
            let mark = if s.is_stop { " (stop)" } else { "" };
            writeln!(
                out,
                "{i:>3} {radius:>11} {:>13} {nd:>8} {vd:>7} {:>10} {:>8} {terms:>6}  {}{mark}",
                fixed(s.thickness_mm, 6),
                fixed(s.conic, 4),
                fixed(s.semi_aperture_mm, 4),
                s.label
            )?;
        }
        Ok(())
    }

    fn write_fields(&self, out: &mut String) -> std::fmt::Result {
        writeln!(
            out,
            "\n field °  height mm  chief ray °  distortion %  light %  rays      RMS d µm  RMS FdC µm"
        )?;
        for (f, light) in &self.fields {
            writeln!(
                out,
                "{:>8.3} {:>10} {:>12} {:>13} {:>8}  {:>3}/{} {:>11} {:>11}",
                f.field.angle_deg,
                number(f.chief_height_mm, 4),
                number(f.chief_ray_angle_deg, 2),
                number(f.distortion_pct, 3),
                number(light.map(|l| 100.0 * l), 1),
                f.rays_through,
                f.rays_sent,
                number(f.rms_d_um, 3),
                number(f.rms_fdc_um, 3),
            )?;
        }
        Ok(())
    }

    /// As one JSON object, full precision.
    pub fn json(&self) -> Value {
        let (p, lens) = (&self.paraxial, self.lens.prescription());
        let surfaces: Vec<Value> = lens
            .surfaces
            .iter()
            .map(|s| {
                let glass = s.glass.map(|g| g.nd_vd());
                json!({
                    "radius_mm": (s.curvature != 0.0).then(|| 1.0 / s.curvature),
                    "thickness_mm": s.thickness_mm, "nd": glass.map(|g| g.0),
                    "vd": glass.map(|g| g.1).filter(|v| v.is_finite()), "conic": s.conic, "aspheric": s.aspheric,
                    "semi_aperture_mm": s.semi_aperture_mm, "is_stop": s.is_stop, "label": s.label,
                })
            })
            .collect();
        let fields: Vec<Value> = self
            .fields
            .iter()
            .map(|(f, light)| {
                json!({
                    "field_deg": f.field.angle_deg, "chief_height_mm": f.chief_height_mm,
                    "chief_ray_angle_deg": f.chief_ray_angle_deg, "distortion_pct": f.distortion_pct,
                    "relative_illumination": light, "rays_through": f.rays_through, "rays_sent": f.rays_sent,
                    "rms_d_um": f.rms_d_um, "rms_fdc_um": f.rms_fdc_um,
                })
            })
            .collect();
        let focus = self.lens.focus_distance_mm();
        json!({
            "file": lens.file, "name": lens.name, "source": lens.source, "dispersive": lens.is_dispersive(),
            "wavelength_nm": D_LINE_NM, "efl_mm": p.efl_mm, "bfl_mm": p.bfl_mm, "f_number": p.f_number,
            "entrance_pupil_z_mm": p.entrance_pupil_z_mm, "entrance_pupil_semi_mm": p.entrance_pupil_semi_mm,
            "exit_pupil_z_mm": p.exit_pupil_z_mm, "exit_pupil_semi_mm": p.exit_pupil_semi_mm,
            "sensor_z_mm": self.lens.sensor_z_mm(), "focus_distance_mm": focus.is_finite().then_some(focus),
            "surfaces": surfaces, "fields": fields,
        })
    }
}

/// A number with some decimals, or a dash.
fn number(value: Option<f64>, decimals: usize) -> String {
    // Adding 0 turns −0 into 0.
    value.map_or("-".into(), |v| fixed(v + 0.0, decimals))
}

/// With some decimals, and by its power of ten where it would have dozens of digits.
fn fixed(value: f64, decimals: usize) -> String {
    match value.abs() >= 1e12 && value.is_finite() {
        true => format!("{value:.3e}"),
        false => format!("{value:.decimals$}"),
    }
}
