//! The Fourier modal level as a table.

use quadpixel::em::PixelStack;
use quadpixel::em::mosaic::FilterColour;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::em::{Level, ModelChoice, PixelModel, Preset};
use quadpixel::response::{
    AngularResponse, BuiltTable, Response, ResponseCache, ResponseError, ShiftSettings, TablePlan,
    TableSettings, build_table,
};

use quadpixel::shard::Shard;
use quadpixel::spectrum::{Bands, ChannelWavelengths};

use crate::conformance::conforms;

/// Few orders: what is held here does not depend on them.
fn few_orders(stack: &PixelStack) -> TableSettings {
    TableSettings {
        model: PixelModel::Rcwa(RcwaSettings {
            silicon_margin: 0.0,
            lens_cutoff: 1.6,
            ..RcwaSettings::draft()
        }),
        steps: 3,
        refine: 2,
        cosine_max: 0.6,
        ..TableSettings::new(Level::Rcwa, Preset::Draft, stack)
    }
}

#[test]
fn rcwa_tables_conform_and_hold_what_single_directions_say() {
    let stack = PixelStack::builtin("1.6um").unwrap();
    let settings = few_orders(&stack);
    let built = build_table(&stack, &settings, None, &|_, _| ()).unwrap();
    assert_eq!(built.report.runs, 10);
    assert_eq!(built.report.violation(), None);
    assert!(built.report.imbalance.abs() < 1e-6 && built.report.residual < 1e-6);
    let single = settings.model.solver(&stack, 550.0).unwrap();
    // Node (−1, 2) of the simulated grid, of which the symmetry simulated another.
    let answer = single.on_microlens(-0.2, 0.4).unwrap();
    let node = built.table.node(0, 0, 6 + 4, 6 - 2);
    for (value, p) in node.iter().zip(&answer.mean.absorbed) {
        assert!((f64::from(*value) - p).abs() < 1e-6, "{value} {p}");
    }
    conforms(&Response::Table(built.table), 550.0, 0.7, 1e-5);
}

#[test]
fn a_table_of_all_lens_shifts_holds_what_single_shifts_say() {
    let stack = PixelStack::builtin("1.6um").unwrap();
    let settings = TableSettings {
        shifts: Some(ShiftSettings {
            per_pitch: 8,
            cone_f_number: 4.0,
        }),
        ..few_orders(&stack)
    };
    let built = build_table(&stack, &settings, None, &|_, _| ()).unwrap();
    assert_eq!(built.report.violation(), None);
    assert!(built.report.imbalance.abs() < 1e-6 && built.report.residual < 1e-6);
    let single = settings.model.solver_of_shifts(&stack, 550.0).unwrap();
    // Node (3, 6) of the shifts, (−0.2, 0.4) of the directions: symmetry simulated others.
    let answer = single.under_shifts(-0.2, 0.4, &[[0.6, -0.4]]);
    let answer = answer.unwrap().remove(0);
    let node = built.table.interpolator_at_shift([3, 6], 550.0).unwrap();
    let mut found = [0f32; 4];
    node.weights(-0.2, 0.4, &mut found);
    for (value, p) in found.iter().zip(&answer.mean.absorbed) {
        assert!((f64::from(*value) - p).abs() < 1e-5, "{value} {p}");
    }
}

/// Unlike neighbours by scalar waves, beside the supercell by Fourier modes (`benches/runs/2026-11-21/mosaic.md`): P of
/// a left and a right sub-pixel of the paper's 1.6 µm pixel, of the microlens of each light's own colour.
#[test]
fn waves_know_neighbours_of_other_colours_as_modes_do() {
    use FilterColour::{Blue, Green, Red};
    const BY_MODES: [(f64, FilterColour, [[f64; 2]; 4]); 3] = [
        (
            450.0,
            Blue,
            [
                [0.161, 0.161],
                [0.020, 0.292],
                [0.019, 0.227],
                [0.027, 0.079],
            ],
        ),
        (
            532.0,
            Green,
            [
                [0.150, 0.150],
                [0.030, 0.2695],
                [0.0225, 0.213],
                [0.041, 0.095],
            ],
        ),
        (
            620.0,
            Red,
            [
                [0.129, 0.129],
                [0.032, 0.218],
                [0.021, 0.171],
                [0.041, 0.076],
            ],
        ),
    ];
    let model = ModelChoice::new(Level::Wave, Preset::Standard).model();
    for (nm, colour, rows) in BY_MODES {
        let stack = PixelStack::builtin("1.6um-bayer")
            .unwrap()
            .with_colour(colour);
        let solver = model.solver(&stack, nm).unwrap();
        for (theta, wanted) in (0..).map(|k| f64::from(10 * k)).zip(rows) {
            let light = solver.on_microlens(theta.to_radians().sin(), 0.0).unwrap();
            let p = &light.mean.absorbed;
            for (k, wanted) in wanted.iter().enumerate() {
                let half = p[k];
                assert!(
                    (half - wanted).abs() < 0.015,
                    "{nm} nm, {theta} deg: {half} {wanted}"
                );
            }
        }
    }
}

/// Tables of all lens shifts under a mosaic: red and blue microlenses, which little light of green passes, stand as the
/// green ones do.
#[test]
fn the_microlenses_of_a_mosaic_have_one_layout() {
    let mut stack = PixelStack::builtin("1.4um-dual").unwrap();
    stack.mosaic = PixelStack::builtin("1.6um-bayer").unwrap().mosaic;
    let settings = TableSettings {
        steps: 4,
        refine: 2,
        cosine_max: 0.6,
        shifts: Some(ShiftSettings {
            per_pitch: 8,
            cone_f_number: 2.8,
        }),
        ..TableSettings::new(Level::Wave, Preset::Draft, &stack)
    };
    let plan = TablePlan::new(&stack, &settings).unwrap();
    let tables = plan.build_colours(None, &|_, _| ()).unwrap();
    let layouts: Vec<_> = (tables.iter())
        .map(|built| built.table.meta().chief_ray_shifts.clone().unwrap())
        .collect();
    assert!(layouts.len() == 3 && layouts[0] == layouts[1] && layouts[2] == layouts[1]);
    assert!(layouts[1].at(0.17, 0.0).shift_um[0] < -0.05);
}

/// The tables of all colours of a mosaic.
fn colours(stack: &PixelStack, settings: &TableSettings) -> Vec<BuiltTable> {
    let plan = TablePlan::new(stack, settings).unwrap();
    plan.build_colours(None, &|_, _| ()).unwrap()
}

fn from_channels(
    built: &[BuiltTable],
    channels: &ChannelWavelengths,
) -> Result<AngularResponse, ResponseError> {
    AngularResponse::from_channels([0, 1, 2].map(|i: usize| &built[i].table), channels)
}

/// A small pixel under a mosaic: a table per colour, of one simulation, is what single directions of that colour say,
/// and has the symmetries of the square.
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
        ..TableSettings::new(Level::Rcwa, Preset::Draft, &stack)
    };
    let built = colours(&stack, &settings);
    let bands = ChannelWavelengths::from_bands(Bands::default()).unwrap();
    let e = from_channels(&built, &bands).unwrap_err();
    assert!(e.to_string().contains("one of the table's"), "{e}");
    // Green light.
    let [red, green, blue] = [0, 1, 2].map(|i: usize| built[i].report.largest_sum);
    assert!(green > red && green > blue);
    for (colour, made) in FilterColour::ALL.into_iter().zip(&built) {
        assert_eq!((made.report.runs, made.report.violation()), (6, None));
        stack.mosaic.as_mut().unwrap().colour = colour;
        assert_eq!(made.table.meta().key, settings.key(&stack).unwrap());
        let single = settings.model.solver(&stack, 550.0).unwrap();
        // Node (−1, 2) of the simulated grid, of which the symmetry simulated another.
        let answer = single.on_microlens(-0.3, 0.6).unwrap();
        let node = made.table.node(0, 0, 4 + 4, 4 - 2);
        for (value, p) in node.iter().zip(&answer.mean.absorbed) {
            assert!((f64::from(*value) - p).abs() < 1e-6, "{value} {p}");
        }
    }
    stack.mosaic = None;
    let plan = TablePlan::new(&stack, &settings).unwrap();
    let e = plan.of_mosaic().unwrap_err();
    assert!(e.to_string().contains("mosaic is absent"), "{e}");
}

/// A killed build of a mosaic repeats nothing: what one part of two has done is used by the build of all colours, whose
/// bits are those of one in one go, and which are kept.
#[test]
fn tables_of_a_mosaic_go_on_from_a_part_and_are_kept() {
    let mut stack = PixelStack::builtin("1.6um-bayer").unwrap();
    (stack.pitch_um, stack.silicon_um) = (0.6, 0.5);
    (stack.lens.radius_um, stack.lens.height_um) = (0.5, 0.5);
    let settings = TableSettings {
        model: PixelModel::Rcwa(RcwaSettings {
            silicon_margin: 0.0,
            lens_cutoff: 1.2,
            slice_nm: 80.0,
            ..RcwaSettings::draft()
        }),
        steps: 2,
        refine: 1,
        cosine_max: 0.6,
        ..TableSettings::new(Level::Rcwa, Preset::Draft, &stack)
    };
    let folder = tempfile::tempdir().unwrap();
    let cache = ResponseCache::open(folder.path());
    let plan = TablePlan::new(&stack, &settings)
        .unwrap()
        .of_mosaic()
        .unwrap();
    let half = Shard::new(1, 2).unwrap();
    let part = cache.make_part(&plan, half, &|_, _| ()).unwrap();
    let whole = cache.tables(&plan, &|_, _| ()).unwrap();
    assert!(whole.warnings.is_empty(), "{:?}", whole.warnings);
    for (i, built) in colours(&stack, &settings).into_iter().enumerate() {
        let (table, report) = &whole.tables[i];
        let report = report.as_ref().unwrap();
        assert!(0 < part.runs && part.runs < report.runs);
        assert_eq!(report.reused, part.runs);
        assert_eq!(*table, built.table);
    }
    let again = cache.tables(&plan, &|_, _| ()).unwrap();
    assert!(again.tables.iter().all(|(_, report)| report.is_none()));
}

/// Channels that are bands: each wavelength's values are those of the colour whose band it stands for.
#[test]
fn a_table_of_bands_takes_each_wavelength_from_the_microlenses_of_its_colour() {
    let mut stack = PixelStack::builtin("1.6um-bayer").unwrap();
    (stack.pitch_um, stack.silicon_um) = (0.6, 0.5);
    (stack.lens.radius_um, stack.lens.height_um) = (0.5, 0.5);
    let channels = ChannelWavelengths::from_bands(Bands {
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
        shifts: None,
    };
    let built = colours(&stack, &settings);
    let table = from_channels(&built, &channels).unwrap();
    assert_eq!(table.axes().wavelengths_nm, channels.all_response_nm());
    for (channel, made) in built.iter().enumerate() {
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
        let of_colour = &made.table;
        assert_eq!(
            table.node(place(&table), 0, 1, 2),
            of_colour.node(place(of_colour), 0, 1, 2)
        );
        // Another colour's filter takes this light.
        let other = &built[(channel + 1) % 3].table;
        assert_ne!(
            table.node(place(&table), 0, 1, 2),
            other.node(place(other), 0, 1, 2)
        );
    }
    // Lines all ask for the reference wavelength: whose it is, nobody can say.
    let e = from_channels(&built, &ChannelWavelengths::default()).unwrap_err();
    assert!(
        e.to_string().contains("each in the band of one channel"),
        "{e}"
    );
}
