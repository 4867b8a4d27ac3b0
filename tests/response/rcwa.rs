//! The Fourier modal level as a table.

use quadpixel::em::PixelStack;
use quadpixel::em::mosaic::FilterColour;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::response::{
    AngularResponse, LitPixel, PixelModel, Response, ShiftedPixel, ShiftedSettings, TableSettings,
    build_mosaic_tables, build_shifted_table, build_table,
};

use quadpixel::spectrum::{Bands, ChannelWavelengths};

use crate::conformance::conforms;

/// Few orders: what is held here does not depend on them.
fn few_orders() -> TableSettings {
    TableSettings {
        model: PixelModel::Rcwa(RcwaSettings {
            silicon_margin: 0.0,
            lens_cutoff: 1.6,
            ..RcwaSettings::draft()
        }),
        steps: 3,
        refine: 2,
        cosine_max: 0.6,
        ..TableSettings::rcwa_draft()
    }
}

#[test]
fn rcwa_tables_conform_and_hold_what_single_directions_say() {
    let (stack, settings) = (PixelStack::builtin("1.6um").unwrap(), few_orders());
    let built = build_table(&stack, &settings, None, &|_, _| ()).unwrap();
    assert_eq!(built.report.runs, 10);
    assert_eq!(built.report.violation(), None);
    assert!(built.report.imbalance.abs() < 1e-6 && built.report.residual < 1e-6);
    let single = LitPixel::new(&stack, &settings.model, 550.0).unwrap();
    // Node (−1, 2) of the simulated grid, of which the symmetry simulated another.
    let answer = single.light(-0.2, 0.4).unwrap();
    let node = built.table.node(0, 0, 6 + 4, 6 - 2);
    for (value, p) in node.iter().zip(&answer.mean.absorbed) {
        assert!((f64::from(*value) - p).abs() < 1e-6, "{value} {p}");
    }
    conforms(&Response::Table(built.table), 550.0, 0.7, 1e-5);
}

#[test]
fn a_table_of_all_lens_shifts_holds_what_single_shifts_say() {
    let stack = PixelStack::builtin("1.6um").unwrap();
    let settings = ShiftedSettings {
        table: few_orders(),
        per_pitch: 8,
        cone_f_number: 4.0,
    };
    let built = build_shifted_table(&stack, &settings, None, &|_, _| ()).unwrap();
    assert_eq!(built.report.violation(), None);
    assert!(built.report.imbalance.abs() < 1e-6 && built.report.residual < 1e-6);
    let single = ShiftedPixel::new(&stack, &settings.table.model, 550.0).unwrap();
    // Node (3, 6) of the shifts, (−0.2, 0.4) of the directions: symmetry simulated others.
    let answer = single.light(-0.2, 0.4, &[[0.6, -0.4]]).unwrap().remove(0);
    let node = built.table.interpolator_at_shift([3, 6], 550.0).unwrap();
    let mut found = [0f32; 4];
    node.weights(-0.2, 0.4, &mut found);
    for (value, p) in found.iter().zip(&answer.mean.absorbed) {
        assert!((f64::from(*value) - p).abs() < 1e-5, "{value} {p}");
    }
}

/// A small pixel under a mosaic: a table a colour, of one simulation, is what single directions of that colour say, and has the symmetries of
/// the square.
#[test]
fn the_tables_of_a_mosaic_are_those_of_its_colours() {
    let mut stack = PixelStack::builtin("1.6um-bayer").unwrap();
    (stack.pitch_um, stack.silicon_um) = (0.9, 1.0);
    (stack.lens.radius_um, stack.lens.height_um) = (0.7, 0.7);
    let settings = TableSettings {
        model: PixelModel::Rcwa(RcwaSettings {
            silicon_margin: 0.0,
            lens_cutoff: 1.6,
            slice_nm: 80.0,
            ..RcwaSettings::draft()
        }),
        steps: 2,
        refine: 2,
        cosine_max: 0.6,
        ..TableSettings::rcwa_draft()
    };
    let built = build_mosaic_tables(&stack, &settings, &|_, _| ()).unwrap();
    let bands = ChannelWavelengths::of_bands(Bands::default()).unwrap();
    let e = built.of_channels(&bands).unwrap_err();
    assert!(e.to_string().contains("one of the table's"), "{e}");
    // Green light.
    let total = |colour| built.of(colour).report.largest_sum;
    assert!(total(FilterColour::Green) > total(FilterColour::Red));
    assert!(total(FilterColour::Green) > total(FilterColour::Blue));
    for colour in FilterColour::ALL {
        let made = built.of(colour);
        assert_eq!((made.report.runs, made.report.violation()), (6, None));
        stack.mosaic.as_mut().unwrap().colour = colour;
        assert_eq!(made.table.meta().key, settings.key(&stack));
        let single = LitPixel::new(&stack, &settings.model, 550.0).unwrap();
        // Node (−1, 2) of the simulated grid, of which the symmetry simulated another.
        let answer = single.light(-0.3, 0.6).unwrap();
        let node = made.table.node(0, 0, 4 + 4, 4 - 2);
        for (value, p) in node.iter().zip(&answer.mean.absorbed) {
            assert!((f64::from(*value) - p).abs() < 1e-6, "{value} {p}");
        }
    }
    stack.mosaic = None;
    let e = build_mosaic_tables(&stack, &settings, &|_, _| ()).unwrap_err();
    assert!(e.to_string().contains("mosaic is absent"), "{e}");
}

/// Channels that are bands: each wavelength's values are those of the colour whose band it stands for.
#[test]
fn a_table_of_bands_takes_each_wavelength_from_the_microlenses_of_its_colour() {
    let mut stack = PixelStack::builtin("1.6um-bayer").unwrap();
    (stack.pitch_um, stack.silicon_um) = (0.6, 0.5);
    (stack.lens.radius_um, stack.lens.height_um) = (0.5, 0.5);
    let channels = ChannelWavelengths::of_bands(Bands {
        wavelengths: 1,
        ..Bands::default()
    })
    .unwrap();
    let settings = TableSettings {
        model: PixelModel::Rcwa(RcwaSettings {
            silicon_margin: 0.0,
            lens_cutoff: 1.2,
            slice_nm: 100.0,
            ..RcwaSettings::draft()
        }),
        wavelengths_nm: channels.all_response_nm(),
        steps: 2,
        refine: 1,
        cosine_max: 0.3,
    };
    let built = build_mosaic_tables(&stack, &settings, &|_, _| ()).unwrap();
    let table = built.of_channels(&channels).unwrap();
    assert_eq!(table.axes().wavelengths_nm, channels.all_response_nm());
    for (channel, colour) in FilterColour::ALL.into_iter().enumerate() {
        let [nm] = channels.response_nm(channel)[..] else {
            panic!("one wavelength a band")
        };
        let place = |t: &AngularResponse| {
            t.axes()
                .wavelengths_nm
                .iter()
                .position(|w| *w == nm)
                .unwrap()
        };
        let own = &built.of(colour).table;
        assert_eq!(
            table.node(place(&table), 0, 1, 2),
            own.node(place(own), 0, 1, 2)
        );
        // Another colour's filter takes this light.
        let other = &built.of(FilterColour::ALL[(channel + 1) % 3]).table;
        assert_ne!(
            table.node(place(&table), 0, 1, 2),
            other.node(place(other), 0, 1, 2)
        );
    }
    // Lines all ask for the reference wavelength: whose it is, nobody can say.
    let e = built
        .of_channels(&ChannelWavelengths::default())
        .unwrap_err();
    assert!(
        e.to_string().contains("each in the band of one channel"),
        "{e}"
    );
}
