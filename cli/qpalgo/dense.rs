//! `qpalgo disparity --dense` and `--network`: opposite views in; their disparity and its standard deviation at every
//! pixel out.

use std::path::Path;

use crate::exit::CommandError;
use crate::outln;
use crate::progress::Progress;
use quadpixel::file;
use quadpixel::image::colour::{blue_white_red, viridis};
use quadpixel::image::raster::encode_png8;
use quadpixel::image::views::sum_of;
use quadpixel::image::{Image, ImageError, channel};
use quadpixel_algorithms::dense::{
    BlurRatio, DenseMap, Halves, OppositePair, OppositeViews, dense_disparity_of,
    learned_disparity_of,
};
use quadpixel_algorithms::maps::{MapFormat, Maps};

use crate::qpalgo::disparity::DisparityArgs;
use crate::qpalgo::inputs::in_file;

/// Matches and writes; no file is written before all are made.
pub fn run(args: &DisparityArgs, progress: Progress) -> Result<(), CommandError> {
    let network = args.network.read()?;
    let given = args.ratio.map(BlurRatio::Whole);
    progress.stage(format!("reading {}", args.view.display()));
    let (map, is_known, vertical) = match &args.reference {
        Some(_) if !args.source.is_empty() => {
            return Err(CommandError::input(
                "--subpixels, --camera and --meta are for a capture, without REFERENCE",
            ));
        }
        Some(reference) => {
            let pair = args.pair.read(&args.view, reference)?;
            let [left, right] = pair.each_ref().map(of_reference);
            let picture = if pair[0].channels() > 1 {
                sum_of(&pair)
            } else {
                None
            };
            progress.stage("matching");
            let pair = OppositePair {
                views: [&left, &right],
                ratio: given.as_ref(),
            };
            let views = OppositeViews {
                left_right: Some(pair),
                picture: picture.as_ref(),
                ..OppositeViews::default()
            };
            let map = match &network {
                Some(network) => learned_disparity_of(views, network),
                None => dense_disparity_of(views),
            };
            (map, given.is_some(), false)
        }
        None => {
            let halves = Halves::new(&args.source.read(&args.view)?);
            let halves = match &given {
                Some(ratio) => halves.with_ratio(ratio),
                None => halves,
            };
            progress.stage("matching");
            let map = match &network {
                Some(network) => halves.learned_disparity(network),
                None => halves.disparity(),
            };
            (map, halves.ratio().is_some(), halves.is_vertical())
        }
    };
    let map = map.map_err(in_file(&args.view))?;
    progress.stage("encoding the maps");
    let files = files(args.format.into(), &map, vertical).map_err(CommandError::failed)?;
    file::write_reports(&args.out, &files)?;
    drop(progress);
    report(args, &map, &files, is_known)
}

/// Green of a picture in colour, else its first channel.
fn of_reference(image: &Image) -> Image {
    channel(image, if image.channels() >= 3 { 1 } else { 0 })
}

type Files = Vec<(String, Vec<u8>)>;

fn files(format: MapFormat, map: &DenseMap, vertical: bool) -> Result<Files, ImageError> {
    let (width, height) = (map.disparity_px.width(), map.disparity_px.height());
    let mut numbers = Image::zeros(width, height, 2);
    let values = map.disparity_px.data().iter().zip(map.sigma_px.data());
    for (to, (d, s)) in numbers.data_mut().chunks_exact_mut(2).zip(values) {
        to.copy_from_slice(&[*d, *s]);
    }
    let channels = if vertical {
        ["dy", "sigma"]
    } else {
        ["dx", "sigma"]
    };
    let maps = Maps {
        stem: "disparity",
        channels: &channels,
        maps: &[(String::new(), numbers)],
    };
    let most = largest(&map.disparity_px).max(f32::MIN_POSITIVE);
    let signed = |v: f32| blue_white_red(0.5 + 0.5 * v / most);
    let widest = largest(&map.sigma_px).max(f32::MIN_POSITIVE);
    let sure = |v: f32| viridis(v / widest);
    let picture = |name: &str, image: &Image, colour: &dyn Fn(f32) -> [u8; 3]| {
        let codes: Vec<u8> = image.data().iter().flat_map(|v| colour(*v)).collect();
        let bytes = encode_png8(Path::new(name), &codes, width, height, 3)?;
        Ok::<_, ImageError>((name.to_owned(), bytes))
    };
    let (numbers, pictures) = rayon::join(
        || maps.encode(format),
        || {
            let disparity = picture("disparity.png", &map.disparity_px, &signed)?;
            Ok::<_, ImageError>([disparity, picture("sigma.png", &map.sigma_px, &sure)?])
        },
    );
    let mut files = numbers?;
    files.extend(pictures?);
    Ok(files)
}

/// Largest size of a number.
fn largest(image: &Image) -> f32 {
    image.data().iter().fold(0.0, |most, v| most.max(v.abs()))
}

fn median(image: &Image) -> f32 {
    let mut values = image.data().to_vec();
    let middle = values.len() / 2;
    match middle < values.len() {
        true => *values.select_nth_unstable_by(middle, f32::total_cmp).1,
        false => 0.0,
    }
}

fn report(
    args: &DisparityArgs,
    map: &DenseMap,
    files: &Files,
    is_blur_known: bool,
) -> Result<(), CommandError> {
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    let (disparity, sigma) = (median(&map.disparity_px), median(&map.sigma_px));
    if args.json {
        let object = serde_json::json!({
            "files": names, "median_px": disparity, "median_sigma_px": sigma, "range_px": map.range_px,
            "halvings": map.halvings, "blur_known": is_blur_known,
        });
        outln!("{object}");
        return Ok(());
    }
    outln!("{}: {}", args.out.display(), names.join(" "));
    outln!(
        "every pixel: median {disparity:.3} px, sigma {sigma:.3} px; looked from {:.2} to {:.2} px at 1/{} of the resolution",
        map.range_px[0],
        map.range_px[1],
        1u32 << map.halvings
    );
    if !is_blur_known {
        outln!(
            "no description of the camera: the blur is assumed; scale and zero of the disparity are free, and sigma leaves them out"
        );
    }
    Ok(())
}
