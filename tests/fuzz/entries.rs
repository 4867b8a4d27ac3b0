//! What reads files of others: one function a format, from bytes to whether they were accepted. None may panic, hang or
//! ask for memory that the bytes do not fill, whatever they are.
//!
//! Readers that take a path get a file in a folder of the thread's own.

use std::path::Path;

use quadpixel::em::PixelStack;
use quadpixel::journal::Journal;
use quadpixel::lens::{Lens, Prescription};
use quadpixel::render::RayRecord;
use quadpixel::response::{AngularResponse, ImportSettings};
use quadpixel::scene::import::{Imported, bounds_mm, import, import_bytes, read_panorama};
use quadpixel::scene::world::World;
use quadpixel_algorithms::calibration::Calibration;
use quadpixel_algorithms::camera;
use quadpixel_algorithms::depth::FieldCurve;
use quadpixel_algorithms::maps;
use quadpixel_datasets::{DatasetManifest, SampleMeta, check_dataset, paths, read_description};
use quadpixel_generators::config::DatasetConfig;
use quadpixel_generators::recipe::Recipe;
use quadpixel_generators::recipe::read_recipe;
use quadpixel_laboratory::fit::capture::CaptureDescription;

/// Whether the bytes are a file that is read.
pub type Read = fn(&[u8]) -> bool;

/// Name and function of every format; the name is that of the fuzz target and of its folder in `corpus`.
pub const ENTRIES: [(&str, Read); 23] = [
    ("gltf", gltf),
    ("obj", obj),
    ("mtl", mtl),
    ("picture", picture),
    ("panorama_hdr", panorama_hdr),
    ("panorama_exr", panorama_exr),
    ("lens_zmx", lens_zmx),
    ("lens_seq", lens_seq),
    ("lens_json", lens_json),
    ("pixel_toml", pixel_toml),
    ("recipe_toml", recipe_toml),
    ("recipe_json", recipe_json),
    ("dataset_toml", dataset_toml),
    ("response_csv", response_csv),
    ("response_npz", response_npz),
    ("rays_npz", rays_npz),
    ("map", map),
    ("calibration_json", calibration_json),
    ("dataset_json", dataset_json),
    ("meta_json", meta_json),
    ("camera_json", camera_json),
    ("capture_toml", capture_toml),
    ("journal", journal),
];

/// Triangles up to which a world is prepared for rays, too: it takes far longer than reading.
const SMALL: usize = 300;

/// A glTF or GLB file.
pub fn gltf(bytes: &[u8]) -> bool {
    import_bytes(bytes, false, "fuzz.glb").is_ok_and(prepared)
}

/// An OBJ file.
pub fn obj(bytes: &[u8]) -> bool {
    import_bytes(bytes, true, "fuzz.obj").is_ok_and(prepared)
}

/// The material library of an OBJ file.
pub fn mtl(bytes: &[u8]) -> bool {
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 3/1 2/1 1/1\n";
    in_folder(|folder| {
        write(&folder.join("a.obj"), obj.as_bytes());
        write(&folder.join("a.mtl"), bytes);
        import(&folder.join("a.obj"), None).is_ok_and(prepared)
    })
}

fn prepared(scene: Imported) -> bool {
    bounds_mm(&scene.world);
    let triangles: usize = scene.world.meshes.iter().map(|m| m.triangles.len()).sum();
    triangles > SMALL || World::new(scene.world).is_ok()
}

/// A picture (PNG, JPEG, TIFF), by its own first bytes.
pub fn picture(bytes: &[u8]) -> bool {
    ["png", "jpg", "tif"].into_iter().any(|ending| {
        as_file(bytes, ending, |p| {
            quadpixel_algorithms::load::image(p).is_ok()
        })
    })
}

/// A panorama in Radiance's format.
pub fn panorama_hdr(bytes: &[u8]) -> bool {
    as_file(bytes, "hdr", |p| read_panorama(p).is_ok())
}

/// An OpenEXR file, as a panorama and as any picture.
pub fn panorama_exr(bytes: &[u8]) -> bool {
    as_file(bytes, "exr", |p| {
        let any = quadpixel_algorithms::load::layers(p).is_ok();
        read_panorama(p).is_ok() && any
    })
}

/// A Zemax lens file.
pub fn lens_zmx(bytes: &[u8]) -> bool {
    Prescription::from_zmx(bytes, "fuzz.zmx").is_ok_and(|p| Lens::new(&p).is_ok())
}

/// A CODE V lens file.
pub fn lens_seq(bytes: &[u8]) -> bool {
    Prescription::from_seq(bytes, "fuzz.seq").is_ok_and(|p| Lens::new(&p).is_ok())
}

/// A lens of our own format.
pub fn lens_json(bytes: &[u8]) -> bool {
    text(bytes, |t| {
        Prescription::from_json(t, "fuzz.json").is_ok_and(|p| Lens::new(&p).is_ok())
    })
}

/// A pixel stack.
pub fn pixel_toml(bytes: &[u8]) -> bool {
    text(bytes, |t| PixelStack::from_toml(t, "fuzz.toml").is_ok())
}

/// A recipe.
pub fn recipe_toml(bytes: &[u8]) -> bool {
    text(bytes, |t| toml::from_str::<Recipe>(t).is_ok())
}

/// The `meta.json` of a sample, as a recipe.
pub fn recipe_json(bytes: &[u8]) -> bool {
    as_file(bytes, "json", |p| read_recipe(p).is_ok())
}

/// The configuration of a dataset, with the first recipe drawn from it.
pub fn dataset_toml(bytes: &[u8]) -> bool {
    text(bytes, |t| {
        DatasetConfig::from_toml(t, "fuzz.toml").is_ok_and(|config| {
            quadpixel_generators::draw::recipe(&config, 0, &|_| Ok(2.8)).is_ok()
        })
    })
}

/// Another tool's angular response.
pub fn response_csv(bytes: &[u8]) -> bool {
    let settings = ImportSettings {
        wavelength_nm: 550.0,
        symmetric: true,
    };
    let Ok(stack) = PixelStack::builtin("2.8um") else {
        return false;
    };
    as_file(bytes, "csv", |p| {
        AngularResponse::read_csv(p, &stack, &settings).is_ok()
    })
}

/// A table of an angular response.
pub fn response_npz(bytes: &[u8]) -> bool {
    as_file(bytes, "npz", |p| AngularResponse::read_npz(p).is_ok())
}

/// Kept rays.
pub fn rays_npz(bytes: &[u8]) -> bool {
    as_file(bytes, "npz", |p| RayRecord::read_npz(p).is_ok())
}

/// A map of numbers: PFM, NPY or EXR, by its first bytes.
pub fn map(bytes: &[u8]) -> bool {
    as_file(bytes, "map", |p| maps::read(p).is_ok())
}

/// What `qpalgo` has measured of a camera: a calibration, or a field curve.
pub fn calibration_json(bytes: &[u8]) -> bool {
    let curve = text(bytes, |t| FieldCurve::from_json(t, "fuzz.json").is_ok());
    Calibration::from_json(bytes).is_ok() || curve
}

/// The description of a dataset, and the check of a folder that holds nothing else.
pub fn dataset_json(bytes: &[u8]) -> bool {
    in_folder(|folder| {
        let dataset = folder.join("dataset");
        make_folder(&dataset);
        write(&dataset.join(paths::DATASET), bytes);
        check_dataset(&dataset, &mut |_| {});
        read_description::<DatasetManifest>(bytes).is_ok()
    })
}

/// The `meta.json` of a sample: checked in a dataset, and as that of a capture.
pub fn meta_json(bytes: &[u8]) -> bool {
    in_folder(|folder| {
        let sample = folder.join("with-sample/samples/000000");
        make_folder(&sample);
        let meta = sample.join(paths::META);
        write(&meta, bytes);
        let manifest = include_bytes!("corpus/dataset_json/one.json");
        let dataset = folder.join("with-sample");
        write(&dataset.join(paths::DATASET), manifest);
        check_dataset(&dataset, &mut |_| {});
        let of_camera = camera::read_meta(&meta).is_ok();
        read_description::<SampleMeta>(bytes).is_ok() && of_camera
    })
}

/// A `camera.json`, with the relation of disparity and depth that depth maps come from.
pub fn camera_json(bytes: &[u8]) -> bool {
    as_file(bytes, "json", |p| {
        camera::read_description(p).is_ok_and(|description| {
            let curves = description.disparity.left_right.iter();
            let curves = curves.chain(&description.disparity.top_bottom);
            curves.filter_map(|c| c.at([16.0, 12.0], [32, 24])).count() > 0
        })
    })
}

/// What was captured of a camera, for `qpgen fit`.
pub fn capture_toml(bytes: &[u8]) -> bool {
    as_file(bytes, "toml", |p| {
        CaptureDescription::read(p).is_ok_and(|capture| {
            // The files that it names are not there.
            let folder = p.parent().unwrap_or(Path::new("."));
            capture.pixel();
            capture.measurements(folder).is_err()
        })
    })
}

/// The journal of a response table, under the key that it says.
pub fn journal(bytes: &[u8]) -> bool {
    type Runs = Journal<(usize, (i64, i64), usize), serde_json::Value>;
    let head = bytes.split(|&b| b == b'\n').next().unwrap_or_default();
    let head: Option<serde_json::Value> = serde_json::from_slice(head).ok();
    let key = head.and_then(|head| Some(head.get("key")?.as_str()?.to_owned()));
    let key = key.unwrap_or_default();
    as_file(bytes, "journal", |p| {
        Runs::open(p, &key, &()).is_ok_and(|journal| {
            journal.damaged().is_none() && journal.outcome(&(0, (-4, 0), 0)).is_some()
        })
    })
}

fn text(bytes: &[u8], read: impl Fn(&str) -> bool) -> bool {
    std::str::from_utf8(bytes).is_ok_and(read)
}

/// Memory that the process may have, less than libFuzzer is told: a file that states more is refused, not read.
const MEMORY_BYTES: u64 = 2 << 30;

fn as_file(bytes: &[u8], ending: &str, read: impl Fn(&Path) -> bool) -> bool {
    in_folder(|folder| {
        let path = folder.join(format!("a.{ending}"));
        write(&path, bytes);
        quadpixel_datasets::memory::set_limit(MEMORY_BYTES);
        read(&path)
    })
}

fn in_folder<T>(f: impl FnOnce(&Path) -> T) -> T {
    thread_local! {
        static FOLDER: tempfile::TempDir = tempfile::tempdir().expect("a temporary folder");
    }
    FOLDER.with(|folder| f(folder.path()))
}

fn make_folder(path: &Path) {
    std::fs::create_dir_all(path).expect("a temporary folder that can be written");
}

fn write(path: &Path, bytes: &[u8]) {
    std::fs::write(path, bytes).expect("a temporary folder that can be written");
}
