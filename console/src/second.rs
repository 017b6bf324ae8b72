//! Options of a second variable, light and silhouettes.

use crate::{output, parse};
use anyhow::{Result, bail};
use clap::Args;
use halite::field::{Field, Gradient};
use halite::mesh::{Mesh, cells::Tetrahedra};
use halite::scene::{Scene, automatic::Opacity, widget};
use halite::transfer::TransferFunction;
use halite::transfer::bivariate::Widget;
use halite::transfer::shading::{Light, Shade};
use serde_json::{Map, Value, json};

/// Functions of two variables, light and silhouettes.
#[derive(Args, Clone)]
pub struct Second {
    /// Light the volume by a lamp at the eye, with the gradient as normal: its shares and the highlight's power may follow as
    /// --shade=AMBIENT,DIFFUSE,SPECULAR,POWER
    #[arg(long, value_name = "A,D,S,P", value_parser = parse::shade, num_args = 0..=1, require_equals = true,
        default_missing_value = "0.2,0.7,0.3,20", help_heading = "Second variable and light")]
    shade: Option<Shade>,
    /// Keep what the gradient turns aside from the ray: extinction times (1 - |cosine|)^P
    #[arg(long, value_name = "P", value_parser = parse::not_negative, help_heading = "Second variable and light")]
    silhouette: Option<f64>,
    /// Extinction times a function of the gradient's length, linear between its knots; a length may be a percentage of the
    /// range: 0%:0,50%:1
    #[arg(long, value_name = "G:H,...", value_parser = parse::opacity, allow_hyphen_values = true,
        help_heading = "Second variable and light")]
    gradient_opacity: Option<Opacity>,
    /// A shape over scalar and gradient in the place of colours and opacities, such as
    /// gaussian:center=150,12:sigma=8,4:color=0.2,0.8,0.3:opacity=0.9; uniform, triangle and sinusoid with the keys that scenes
    /// have; may be given again
    #[arg(long, value_name = "KIND:KEY=VALUE:...", value_parser = parse_widget, allow_hyphen_values = true,
        help_heading = "Second variable and light")]
    widget: Vec<Written>,
    /// The array that takes the place of the gradient's length
    #[arg(long, value_name = "NAME", value_parser = parse::name, help_heading = "Second variable and light")]
    pub gradient_array: Option<String>,
}

/// A widget as it is written, in the keys of scenes.
#[derive(Clone)]
struct Written(Map<String, Value>);

/// Colours of widgets that have none of their own, in turn.
const COLORS: [[f64; 3]; 5] =
    [[0.95, 0.6, 0.2], [0.3, 0.6, 0.95], [0.4, 0.85, 0.4], [0.9, 0.35, 0.6], [0.9, 0.9, 0.85]];

/// The opacity of a widget that has none of its own.
const OPACITY: f64 = 0.5;

/// `KIND:KEY=VALUE:…`, a value being a number, numbers with commas between, or a word; `*` is an open end.
fn parse_widget(text: &str) -> Result<Written, String> {
    let mut parts = text.split(':');
    let mut keys = Map::new();
    keys.insert("type".into(), parts.next().unwrap_or_default().into());
    let value = |text: &str| match text.trim() {
        "*" => Value::Null,
        text => text.parse::<f64>().map_or_else(|_| text.into(), |x| json!(x)),
    };
    for part in parts {
        let (key, text) = part.split_once('=').ok_or_else(|| format!("\"{part}\" is not KEY=VALUE"))?;
        let read = if text.contains(',') { text.split(',').map(value).collect() } else { value(text) };
        if keys.insert(key.into(), read).is_some() {
            return Err(format!("\"{key}\" is there twice"));
        }
    }
    let written = Written(keys);
    written.widget(0).map(|_| written)
}

impl Written {
    /// The widget, the `i`th of all.
    fn widget(&self, i: usize) -> Result<Widget, String> {
        let mut keys = self.0.clone();
        keys.entry("color").or_insert_with(|| json!(COLORS[i % COLORS.len()]));
        keys.entry("opacity").or_insert_with(|| json!(OPACITY));
        widget(&Value::Object(keys))
    }
}

impl Second {
    /// Whether any of it was asked for.
    pub fn is_given(&self) -> bool {
        let function = self.gradient_opacity.is_some() || !self.widget.is_empty() || self.gradient_array.is_some();
        function || self.shade.is_some() || self.silhouette.is_some()
    }

    /// Refuses an array that no function looks at, in a picture of `scene` or of a mesh alone.
    pub fn check(&self, scene: Option<&Scene>) -> Result<()> {
        let asked = self.gradient_opacity.is_some() || !self.widget.is_empty();
        let of_two = asked || scene.is_some_and(|s| s.transfer.bivariate().is_some());
        if self.gradient_array.is_some() && !of_two {
            bail!("--gradient-array: nothing asks for a second variable; --gradient-opacity and --widget do");
        }
        Ok(())
    }

    /// The widgets that were asked for.
    pub fn widgets(&self) -> Result<Vec<Widget>> {
        let widgets = self.widget.iter().enumerate().map(|(i, w)| w.widget(i));
        widgets.collect::<Result<_, _>>().map_err(|what| output::misuse(format!("--widget: {what}")))
    }

    /// `transfer` with what was asked for, of a field whose second variable may be another array.
    pub fn apply(
        &self,
        transfer: TransferFunction,
        mesh: &Mesh,
        tetrahedra: &Tetrahedra,
        field: &Field,
    ) -> Result<TransferFunction> {
        let mut bivariate = transfer.bivariate().cloned().unwrap_or_default();
        let mut shading = transfer.shading().cloned().unwrap_or_default();
        let widgets = self.widgets()?;
        if !widgets.is_empty() {
            bivariate = bivariate.with_widgets(widgets)?;
        }
        if let Some(h) = &self.gradient_opacity {
            let range = range(mesh, tetrahedra, field)?;
            bivariate = bivariate.with_gradient_opacity(h.over(range))?;
        }
        if let Some(p) = self.silhouette {
            shading = shading.with_silhouette(p)?;
        }
        if let Some(shade) = self.shade {
            let lights = if shading.lights().is_empty() { vec![Light::default()] } else { shading.lights().to_vec() };
            shading = shading.with_lights(shade, lights)?;
        }
        Ok(transfer.with_bivariate(bivariate).with_shading(shading))
    }
}

/// The least and the greatest of the second variable.
pub fn range(mesh: &Mesh, tetrahedra: &Tetrahedra, field: &Field) -> Result<[f64; 2]> {
    if let Some(second) = field.second() {
        return Ok(second.range(0));
    }
    Ok(Gradient::new(&tetrahedra.points(mesh.points()), tetrahedra, field)?.range())
}
