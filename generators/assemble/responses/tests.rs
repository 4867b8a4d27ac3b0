use super::super::colour::with_colour;
use super::*;
use crate::config::{DEFAULT_TOML, DatasetConfig};
use crate::draw;
use quadpixel::response::TableSettings;

fn recipe(response: &str) -> Recipe {
    let mut config = DatasetConfig::from_toml(DEFAULT_TOML, "t").unwrap();
    config.response = toml::from_str(response).unwrap();
    draw::recipe(&config, 0, &|_| Ok(1.6)).unwrap()
}

fn responses(folder: &Path) -> Responses {
    Responses {
        cache: ResponseCache::open(folder),
        ..Responses::new()
    }
}

#[test]
fn a_table_that_takes_long_is_asked_for_by_the_command_that_makes_it() {
    let folder = tempfile::tempdir().unwrap();
    let stack = PixelStack::builtin("3.5um").unwrap();
    let text = "model = \"rcwa\"\npixels = [\"3.5um\"]\nshifts = 8";
    let mut responses = responses(folder.path());
    let asked = recipe(text);
    let why = responses.get(&asked, &|_, _| ());
    let why = why.unwrap_err().to_string();
    assert!(
        why.contains("qpgen response --model rcwa --pixel 3.5um --subpixels 2x2 --shifts 8"),
        "{why}"
    );
    // A file that is no table is told of.
    let table = asked.response.table().unwrap();
    let nm = asked.wavelengths().unwrap().all_response_nm();
    let key = table.settings(&stack, &nm).key(&stack).unwrap();
    std::fs::write(responses.cache.path(&key), b"no table").unwrap();
    assert!(responses.get(&asked, &|_, _| ()).is_err());
    assert_eq!(responses.take_warnings().len(), 1);
}

/// `qpgen response --model rcwa --preset draft --shifts 4` makes the table that `preset = "draft"` and `shifts = 4`
/// find.
#[test]
fn a_dataset_finds_the_table_that_the_same_words_made() {
    let stack = PixelStack::builtin("1.6um").unwrap();
    let words = ["", "preset = \"draft\"", "preset = \"draft\"\nshifts = 4"];
    let models = ["rcwa", "fdtd", "corrected"];
    let mut keys = Vec::new();
    for model in models {
        for words in words {
            let text = format!("model = \"{model}\"\npixels = [\"1.6um\"]\n{words}");
            let recipe = recipe(&text);
            let table = recipe.response.table().unwrap();
            let preset = match words.is_empty() {
                true => quadpixel::em::Preset::Standard,
                false => quadpixel::em::Preset::Draft,
            };
            // What the command line makes of the same words.
            let choice = quadpixel::em::ModelChoice::new(table.level, preset);
            let commanded = match table.choice.shifts {
                Some(n) => TableSettings::for_all_shifts(&choice, &stack, n),
                None => TableSettings::for_choice(&choice, &stack),
            };
            let key = table.settings(&stack, &[550.0]).key(&stack).unwrap();
            assert_eq!(key, commanded.key(&stack).unwrap());
            keys.push(key);
        }
    }
    keys.sort();
    keys.dedup();
    // The corrected level's directions are those of its preset's wave model.
    assert_eq!(keys.len(), models.len() * words.len());
}

#[test]
fn what_leaving_colour_out_does_is_found_once_and_kept_for_other_runs() {
    let folder = tempfile::tempdir().unwrap();
    let mut recipe = recipe("model = \"wave\"\npixels = [\"1.6um\"]");
    recipe.effects = "none".parse().unwrap();
    let errors = |responses: &mut Responses| {
        let (_, call) = with_colour(&recipe, responses).unwrap();
        call.errors.unwrap()
    };
    let found = errors(&mut responses(folder.path()));
    let path = folder.path().join("colour-errors.jsonl");
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text.lines().count(), 2, "{text}");
    assert_eq!(errors(&mut responses(folder.path())), found);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    // A changed number is none; where nothing can be kept, they are found all the same.
    std::fs::write(&path, text.replace("percent\":", "percent\":1")).unwrap();
    assert_eq!(errors(&mut responses(folder.path())), found);
    std::fs::remove_file(&path).unwrap();
    std::fs::create_dir(&path).unwrap();
    assert_eq!(errors(&mut responses(folder.path())), found);
}

#[test]
fn a_quick_table_that_takes_long_is_asked_for_by_the_command_that_makes_it() {
    let folder = tempfile::tempdir().unwrap();
    let text = "model = \"wave\"\npixels = [\"3.5um\"]\nshifts = 32";
    let why = responses(folder.path()).get(&recipe(text), &|_, _| ());
    let why = why.unwrap_err().to_string();
    assert!(
        why.contains("qpgen response --model wave --pixel 3.5um --subpixels 2x2 --shifts 32"),
        "{why}"
    );
}

#[test]
fn a_table_soon_made_is_made_once_and_then_found() {
    let folder = tempfile::tempdir().unwrap();
    let cache = ResponseCache::open(folder.path());
    let recipe = recipe("model = \"wave\"\npixels = [\"1.6um\"]\nshifts = 4");
    let plan = quick_plan(&recipe).unwrap().unwrap();
    let coarse = TableSettings {
        steps: 3,
        cosine_max: 0.6,
        ..plan.settings().clone()
    };
    let plan = TablePlan::new(plan.stack(), &coarse).unwrap();
    let table = recipe.response.table().unwrap();
    assert!(check_quick(&recipe, table, &plan, &cache).unwrap());
    let first = cache.table(&plan, &|_, _| ()).unwrap();
    assert!(first.report.is_some() && first.table.meta().shift_grid.is_some());
    assert!(!check_quick(&recipe, table, &plan, &cache).unwrap());
    assert_eq!(cache.find(&plan).unwrap(), Some(first.table));
}
