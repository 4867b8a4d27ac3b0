//! What one quarter of a symmetric camera's window sees, mirrored, is what the others see: a camera whose window stands
//! beside the axis by less than any ray can tell has every place traced for itself.

use glam::DVec2;
use quadpixel::lens::{ElementRef, Lens, Misalignment};
use quadpixel::render::Camera;
use quadpixel::render::kernels::{BankPlan, Footprint, KernelBank};
use quadpixel::render::truth::{Defocus, DisparityField, SightRays};
use quadpixel::response::{AngularResponse, Response};
use quadpixel::sensor::MicrolensLaw;

use super::CASES;
use super::shots::{self, boxes, wave_pixel};

const SIZE: (usize, usize) = (300, 210);
/// Of the window from the axis, mm.
const BESIDE: DVec2 = DVec2::new(1e-9, 0.0);

/// A camera on the axis, and the one that nothing is mirrored in.
fn pair(lens: &Lens, response: &Response) -> [Camera; 2] {
    [DVec2::ZERO, BESIDE].map(|centre| shots::camera(lens, response, SIZE, centre))
}

/// Places all over the window, mm.
fn places(camera: &Camera) -> impl Iterator<Item = DVec2> {
    let w = camera.sensor().window_mm();
    let half = DVec2::new(w.half_width, w.half_height);
    let at = |i: usize| (i as f64 - 3.0) / 3.2;
    (0..49).map(move |k| w.centre + half * DVec2::new(at(k % 7), at(k / 7)))
}

#[test]
fn mirrored_places_see_what_they_see_when_they_are_traced() {
    for case in &CASES {
        let lens = case.focused();
        let mut responses = vec![boxes(2, 2, case.pitch_um, case.focal_um)];
        if case.lens == shots::PHONE {
            responses.push(wave_pixel());
        }
        for response in &responses {
            let cameras = pair(&lens, response);
            assert_eq!(cameras.each_ref().map(Camera::is_mirrored), [true, false]);
            let [a, b] = cameras
                .each_ref()
                .map(|camera| DisparityField::of_channels(camera).unwrap());
            let defocus = Defocus::new(&cameras[0]).unwrap();
            let mut worst = [0f64; 2];
            for place in places(&cameras[0]) {
                for (a, b) in a.iter().zip(&b) {
                    for depth_mm in [0.6 * case.focus_mm, 3.0 * case.focus_mm] {
                        // What each of the fields is met to between its nodes.
                        let blur_mm = defocus.circle_of_confusion_mm(depth_mm).abs();
                        let bound_px = 0.01 + 1e-3 * blur_mm / cameras[0].sensor().pitch_mm();
                        let [a, b] = [a, b].map(|field| {
                            let mut told = vec![DVec2::ZERO; response.subpixels().count()];
                            field.traced_px(place, depth_mm, &mut told);
                            told
                        });
                        let apart = a.iter().zip(&b).map(|(a, b)| (*a - *b).length());
                        worst[0] = apart.map(|px| px / bound_px).fold(worst[0], f64::max);
                    }
                }
                let [a, b] = cameras.each_ref().map(|c| c.pupil_at(place).unwrap());
                let semi_mm = b.axis_a_mm.length();
                worst[1] = worst[1].max((a.centre_mm - b.centre_mm).length() / semi_mm);
                worst[1] = worst[1].max((a.area_mm2() / b.area_mm2() - 1.0).abs());
            }
            println!("{}: {worst:?}", case.lens);
            assert!(
                worst[0] < 1.0 && worst[1] < 0.01,
                "{}: {worst:?}",
                case.lens
            );
        }
    }
}

#[test]
fn mirrored_kernels_are_those_that_are_traced() {
    let case = &CASES[0];
    let cameras = pair(&case.focused(), &wave_pixel());
    let plan = BankPlan {
        nodes: (5, 4),
        inverse_depths_per_mm: vec![0.5 / case.focus_mm, 1.6 / case.focus_mm],
        rays: 16384,
        footprint: Footprint::Sample,
        cut_share: 0.0,
    };
    let bank = |camera: Camera| {
        let fields = DisparityField::of_channels(&camera).unwrap();
        let sight = SightRays::centroids(&fields);
        KernelBank::new(&camera, &sight, &fields, &plan).unwrap()
    };
    let diffracted = cameras.clone().map(Camera::with_lens_diffraction);
    // Displacements by diffraction are drawn, some of them far: the worst of 480 is at three deviations of 0.02 px.
    for (cameras, bound_px) in [(cameras, 0.01), (diffracted, 0.1)] {
        let [a, b] = cameras.map(bank);
        let channels = a.channels();
        let mut worst = [0f64; 2];
        for k in 0..2 * 20 * channels * 4 {
            let (depth, node, channel) = (k % 2, k / 2 % 20, k / 40 % channels);
            let of = |bank: &KernelBank| bank.figures(depth, node, channel, k / (40 * channels));
            let (a, b) = (of(&a), of(&b));
            worst[0] = worst[0].max((a.centroid_px - b.centroid_px).length());
            worst[1] = worst[1].max((a.white_sr / b.white_sr - 1.0).abs());
        }
        println!("{worst:?}");
        assert!(worst[0] < bound_px && worst[1] < 3e-3, "{worst:?}");
    }
}

#[test]
fn cameras_that_are_no_mirror_images_are_not_taken_for_any() {
    let case = &CASES[0];
    let (lens, response) = (case.focused(), boxes(2, 1, 2.0, 5.0));
    let camera = shots::camera(&lens, &response, SIZE, DVec2::ZERO);
    assert!(camera.is_mirrored());
    let beside = camera.clone().with_microlens_offset_um(DVec2::X * 0.1);
    assert!(!beside.is_mirrored());
    let law = MicrolensLaw {
        um_per_mm: 0.01,
        axis_x_mm: 0.5,
        ..MicrolensLaw::default()
    };
    assert!(!camera.clone().with_microlens_law(law).is_mirrored());
    let defect = Misalignment {
        dx_um: 1.0,
        ..Misalignment::none(ElementRef::Element(2))
    };
    let lens = lens.perturbed(&[defect]).unwrap();
    assert!(!shots::camera(&lens, &response, SIZE, DVec2::ZERO).is_mirrored());
}

#[test]
fn a_table_of_a_pixel_that_favours_a_side_is_told() {
    let Response::Table(table) = wave_pixel() else {
        unreachable!("a table")
    };
    let told = |table: AngularResponse| Response::Table(table).at(550.0).is_mirrored();
    assert!(told(table.clone()));
    let mut values = table.table().to_vec();
    let middle = values.len() / 8 * 4;
    values[middle] *= 0.999;
    let other = AngularResponse::new(table.axes().clone(), table.meta().clone(), values);
    assert!(!told(other.unwrap()));
}
