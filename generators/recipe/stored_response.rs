//! `[response]` as it stands in configurations, recipes and `meta.json`: a model's name, and the fields that go with
//! it.

use quadpixel::em::{Level, Preset};
use quadpixel::range::{OutOfRange, require};
use quadpixel::sensor::{Charge, CollectedAt};
use quadpixel_datasets::TableColour;
use serde::{Deserialize, Serialize};

use super::table_choice::{ExactModel, TableChoice};

/// The name of a response from a file.
const FILE: &str = "table";
/// The fields of a table's choice.
const CHOICE: [&str; 7] = [
    "shifts",
    "preset",
    "colour",
    "exact",
    "diffusion_um",
    "crosstalk",
    "collected_at",
];

/// All fields, those of one sample (`pixel`) and those of a configuration (`pixels`); `Stack` is how a configuration
/// draws the thickness of layers.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "Stack: Deserialize<'de>"))]
pub(crate) struct StoredResponse<Stack = ()> {
    pub model: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixels: Option<Vec<String>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stack_scale: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shifts: Option<usize>,
    #[serde(default, alias = "grid", skip_serializing_if = "Option::is_none")]
    pub preset: Option<Preset>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<TableColour>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focal_length_um: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub files: Option<Vec<String>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stack: Option<Stack>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<ExactModel>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diffusion_um: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crosstalk: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub collected_at: Option<CollectedAt>,
}

/// What a model's name says.
pub(crate) enum ResponseKind {
    Ideal,
    Table(Level),
    File,
}

impl<Stack> StoredResponse<Stack> {
    pub fn new(kind: ResponseKind) -> Self {
        let model = match kind {
            ResponseKind::Ideal => Level::IDEAL.name(),
            ResponseKind::Table(level) => level.name(),
            ResponseKind::File => FILE,
        };
        Self {
            model: model.to_owned(),
            pixel: None,
            pixels: None,
            stack_scale: None,
            shifts: None,
            preset: None,
            colour: None,
            focal_length_um: None,
            file: None,
            files: None,
            stack: None,
            exact: None,
            diffusion_um: None,
            crosstalk: None,
            collected_at: None,
        }
    }

    pub fn with_table(self, choice: TableChoice, charge: Charge) -> Self {
        let given = |number: f64| Some(number).filter(|number| *number != 0.0);
        Self {
            diffusion_um: given(charge.diffusion_um),
            crosstalk: given(charge.crosstalk),
            collected_at: Some(charge.collected_at)
                .filter(|at| *at != CollectedAt::Anywhere && charge.diffusion_um != 0.0),
            shifts: choice.shifts,
            preset: Some(choice.preset).filter(|preset| !preset.is_standard()),
            colour: choice.colour,
            exact: choice.exact,
            ..self
        }
    }

    pub fn choice(&self) -> TableChoice {
        TableChoice {
            preset: self.preset.unwrap_or_default(),
            shifts: self.shifts,
            colour: self.colour,
            exact: self.exact,
        }
    }

    /// Diffusion asks for a table of all lens shifts.
    pub fn charge(&self) -> Result<Charge, OutOfRange> {
        let charge = Charge {
            diffusion_um: self.diffusion_um.unwrap_or(0.0),
            crosstalk: self.crosstalk.unwrap_or(0.0),
            collected_at: self.collected_at.unwrap_or_default(),
        };
        charge.check()?;
        require(charge.diffusion_um == 0.0 || self.shifts.is_some(), || {
            let allowed = "0, or with shifts: a table of all lens shifts";
            OutOfRange::new("response", "diffusion_um", charge.diffusion_um, allowed)
        })?;
        let is_idle = self.collected_at.is_some() && charge.diffusion_um == 0.0;
        require(!is_idle, || {
            let allowed = "together with diffusion_um above 0";
            OutOfRange::new("response", "collected_at", "alone", allowed)
        })?;
        Ok(charge)
    }

    /// What the model's name says, once every field is one of its own: of a pixel's table `pixel`, its name and what
    /// its layers are, of a file `file`. The first of each must be there.
    pub fn kind(
        &self,
        pixel: [&'static str; 2],
        file: &'static str,
    ) -> Result<ResponseKind, OutOfRange> {
        let kind = match self.model.as_str() {
            FILE => ResponseKind::File,
            name => match name.parse() {
                Ok(Level::IDEAL) => ResponseKind::Ideal,
                Ok(level) => ResponseKind::Table(level),
                Err(OutOfRange { allowed, .. }) => {
                    let allowed = format!("{allowed}, {FILE}");
                    return Err(OutOfRange::new("response", "model", name, allowed));
                }
            },
        };
        let fields: Vec<&str> = match &kind {
            // A configuration has one focal length, that of the lens.
            ResponseKind::Ideal if file == "files" => vec![],
            ResponseKind::Ideal => vec!["focal_length_um"],
            ResponseKind::File => vec![file],
            ResponseKind::Table(_) => pixel.into_iter().chain(CHOICE).collect(),
        };
        let given = self.given();
        let allowed = || match fields.is_empty() {
            true => "no field but model".to_owned(),
            false => format!("with model {}: {}", self.model, fields.join(", ")),
        };
        if let Some(field) = given.iter().find(|field| !fields.contains(field)) {
            return Err(OutOfRange::new("response", *field, "given", allowed()));
        }
        let needed = match kind {
            ResponseKind::Ideal => None,
            _ => fields.first(),
        };
        if let Some(field) = needed.filter(|field| !given.contains(field)) {
            return Err(OutOfRange::new("response", *field, "absent", allowed()));
        }
        let corrected = matches!(kind, ResponseKind::Table(level) if level.is_corrected());
        require(corrected || self.exact.is_none(), || {
            let allowed = "a model that an exact one corrects";
            OutOfRange::new("response", "model", &self.model, allowed)
        })?;
        Ok(kind)
    }

    fn given(&self) -> Vec<&'static str> {
        let fields = [
            ("pixel", self.pixel.is_some()),
            ("pixels", self.pixels.is_some()),
            ("stack_scale", self.stack_scale.is_some()),
            ("stack", self.stack.is_some()),
            ("shifts", self.shifts.is_some()),
            ("preset", self.preset.is_some()),
            ("colour", self.colour.is_some()),
            ("exact", self.exact.is_some()),
            ("diffusion_um", self.diffusion_um.is_some()),
            ("crosstalk", self.crosstalk.is_some()),
            ("collected_at", self.collected_at.is_some()),
            ("focal_length_um", self.focal_length_um.is_some()),
            ("file", self.file.is_some()),
            ("files", self.files.is_some()),
        ];
        let given = fields.into_iter().filter(|(_, given)| *given);
        given.map(|(name, _)| name).collect()
    }
}
