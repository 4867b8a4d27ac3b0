//! The cheaper paths themselves: what they leave alone.

use glam::DVec2;
use quadpixel::effects::{Effect, Shot};
use quadpixel::em::PixelModel;
use quadpixel::em::PixelStack;
use quadpixel::em::wave::WaveSettings;
use quadpixel::render::Camera;
use quadpixel::render::truth::{Defocus, DisparityField, SightRays};
use quadpixel::response::{Response, ResponseLookup, ShiftSettings, TableSettings, build_table};
use quadpixel::spectrum::ChannelWavelengths;

use super::shoot;
use super::shots::{PHONE, camera, focused, wave_pixel, white};

fn phone(response: &Response) -> Shot {
    let lens = focused(PHONE, 500.0);
    let camera = camera(&lens, response, (16, 16), DVec2::new(0.8, -0.5));
    Shot {
        camera,
        scene: white(),
    }
}

/// An effect that was left out is not there to be left out again.
#[test]
fn leaving_out_twice_is_leaving_out_once() {
    let whole = phone(&wave_pixel());
    let effects = [
        Effect::PixelDiffraction,
        Effect::CraVariation,
        Effect::Dispersion,
        Effect::Aberrations,
    ];
    let mut less = whole.clone();
    for effect in effects {
        let once = whole.without(effect).unwrap();
        assert!(once.without(effect).is_none(), "{effect:?}");
        less = less.without(effect).unwrap();
    }
    assert!(effects.into_iter().all(|e| less.without(e).is_none()));
    assert!(!less.camera.is_dispersive() && !less.camera.is_real_lens());
    // A third of the rays, as all channels share them.
    assert_eq!(3 * shoot(&less, 1).stats.rays, shoot(&whole, 1).stats.rays);
}

/// The shifted response at one shift is that of all shifts there: to the rounding of f32 sums (1e-5), but where the cut
/// of a sum above 1 or below 0 differs (1e-3 of the peak).
#[test]
fn a_response_fixed_at_a_shift_is_the_response_of_that_shift() {
    let settings = TableSettings {
        model: PixelModel::Wave(WaveSettings::draft()),
        wavelengths_nm: vec![550.0],
        cosine_max: 0.6,
        steps: 3,
        refine: 1,
        shifts: Some(ShiftSettings {
            per_pitch: 8,
            cone_f_number: 2.0,
        }),
    };
    let stack = PixelStack::paper(1.2, 0.85, 0.85, 0.75);
    let table = build_table(&stack, &settings, None, &|_, _| ())
        .unwrap()
        .table;
    let whole = phone(&Response::Table(table));
    let fixed = whole.without(Effect::CraVariation).unwrap().camera;
    assert!(matches!(fixed.response(), ResponseLookup::Fixed(_)));
    let middle = fixed.sensor().centre_mm();
    let shift = whole.camera.shift_at_um(middle).to_array();
    assert_eq!(
        fixed.shift_at_um(middle + DVec2::splat(0.01)).to_array(),
        shift
    );
    for i in 0..200 {
        let part = |k: usize| ((i * k) % 199) as f32 / 199.0 - 0.5;
        let (u, v) = (part(57), part(83));
        let read = |camera: &Camera| {
            let mut p = vec![0.0; 4];
            camera
                .response()
                .weights_under(shift, &mut [u], &mut [v], &mut p);
            p
        };
        for (a, b) in read(&whole.camera).iter().zip(read(&fixed)) {
            assert!((a - b).abs() < 1e-3, "{u} {v}: {a} {b}");
        }
    }
}

/// Without aberrations the truth is the paraxial one: the traced disparity of each view is the ideal lens's, and the
/// chief ray of a pixel looks where a pinhole at the entrance pupil would.
#[test]
fn without_aberrations_traced_disparity_is_paraxial() {
    let ideal = phone(&wave_pixel()).without(Effect::Aberrations).unwrap();
    let field = DisparityField::new(&ideal.camera, ChannelWavelengths::REFERENCE).unwrap();
    let defocus = Defocus::new(&ideal.camera).unwrap();
    let place = ideal.camera.sensor().centre_mm();
    for depth in [250.0, 500.0, 2000.0, f64::INFINITY] {
        let (mut traced, mut paraxial) = ([DVec2::ZERO; 4], [DVec2::ZERO; 4]);
        field.traced_px(place, depth, &mut traced);
        field.paraxial_px(place, depth, &mut paraxial);
        let blur = defocus.circle_of_confusion_mm(depth) / ideal.camera.sensor().pitch_mm();
        for (t, p) in traced.iter().zip(&paraxial) {
            // Slopes are averaged where tangents of the scene's side are: equal but for the pupil's share of the field
            // angle.
            assert!(
                (*t - *p).length() < 1e-3 + 0.01 * blur.abs(),
                "{depth}: {t} {p}"
            );
        }
    }
    let depth = SightRays::chief_rays(&ideal.camera).geometry(&ideal.camera, &ideal.scene);
    assert!(depth.depth_mm.data().iter().all(|d| *d == f32::INFINITY));
}
