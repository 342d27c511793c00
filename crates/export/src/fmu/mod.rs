//! Functional mock-up units 2.0 and 3.0, for model exchange and co-simulation. They contain the sources and, if the
//! present machine has a C compiler, its binary.

mod binary;
mod description;

use std::io::{Cursor, Write as _};

use coldplate_runtime::Surrogate;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::content::Content;
use crate::name::comment;
use crate::template::{Filling, wrapped};
use crate::{ExportError, File, c99, json};
use description::Description;

/// The part of the C source common to both versions of the interface.
const CORE: &str = include_str!("core.c");

/// The functions that both versions have, as version 3.0 spells them.
const COMMON: &str = include_str!("common.c");
/// Words of [`COMMON`] that version 2.0 spells in another way, in the order in which they are replaced.
const OLDER: [(&str, &str); 8] = [
    ("fmi3Instance", "fmi2Component"),
    ("GetContinuousStateDerivatives", "GetDerivatives"),
    ("Deserialize", "DeSerialize"),
    ("FMUState", "FMUstate"),
    ("Float64", "Real"),
    ("= false;", "= 0;"),
    ("fmi3", "fmi2"),
    ("FMI3", "FMI2"),
];

/// Version of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Version {
    Two,
    Three,
}

impl Version {
    fn key(self) -> &'static str {
        match self {
            Self::Two => "fmi2",
            Self::Three => "fmi3",
        }
    }

    fn common(self) -> String {
        match self {
            Self::Two => OLDER.iter().fold(COMMON.to_owned(), |text, (newer, older)| text.replace(newer, older)),
            Self::Three => COMMON.to_owned(),
        }
    }

    fn interface(self) -> &'static str {
        match self {
            Self::Two => include_str!("fmi2.c"),
            Self::Three => concat!(include_str!("fmi3.c"), include_str!("fmi3_absent.c")),
        }
    }
}

pub(crate) fn write(surrogate: &Surrogate<'_>, content: &Content, name: &str, version: Version) -> Result<Vec<File>, ExportError> {
    let token = token(&format!("{} {}", version.key(), json::write(surrogate, content, None)));
    let mut sources = c99::write(content, name);
    sources.push(File::new(format!("{name}_{}.c", version.key()), interface(content, name, &token, version).into_bytes()));
    let description = Description { content, name, token: &token };
    let names: Vec<&str> = sources.iter().map(|file| file.name.as_str()).filter(|name| name.ends_with(".c")).collect();
    let mut entries = match version {
        Version::Two => vec![("modelDescription.xml".to_owned(), description.two(&names).into_bytes())],
        Version::Three => vec![
            ("modelDescription.xml".to_owned(), description.three().into_bytes()),
            ("sources/buildDescription.xml".to_owned(), description.build(&names).into_bytes()),
        ],
    };
    let built = binary::build(&sources, name, version);
    entries.extend(sources.into_iter().map(|file| (format!("sources/{}", file.name), file.content)));
    let remark = match built {
        Ok(binary) => {
            let remark = format!("with sources and the binary for {}", binary.platform);
            entries.push((format!("binaries/{}/{name}{}", binary.platform, std::env::consts::DLL_SUFFIX), binary.content));
            remark
        }
        Err(reason) => format!("with sources alone: {reason}"),
    };
    let content = archive(&entries).map_err(|error| ExportError::Archive(error.to_string()))?;
    Ok(vec![File { name: format!("{name}.fmu"), content, remark: Some(remark) }])
}

fn archive(entries: &[(String, Vec<u8>)]) -> zip::result::ZipResult<Vec<u8>> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in entries {
        writer.start_file(name.as_str(), SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored))?;
        writer.write_all(content)?;
    }
    Ok(writer.finish()?.into_inner())
}

/// The C source of the interface.
fn interface(content: &Content, name: &str, token: &str, version: Version) -> String {
    let mut filling = Filling::of(content);
    filling.block("head", format!(" * {}: interface {} of the surrogate.\n", comment(name), version.key()));
    filling.block("include", format!("#include \"{name}.h\"\n"));
    filling.block("counts", format!("#define {}_TOKEN \"{token}\"\n", name.to_uppercase()));
    let table = |what: &str, values: Vec<f64>| {
        let entries: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
        format!("static const double {name}_{what}[{}] = {{\n{}}};\n", entries.len(), wrapped(&entries, "   "))
    };
    let variables = &content.variables;
    let mut tables = table("range_low", variables.iter().map(|v| v.low).collect());
    tables += &table("range_high", variables.iter().map(|v| v.high).collect());
    tables += &table("starts", variables.iter().map(description::start).collect());
    filling.block("tables", tables);
    filling.block("common", filling.fill(&version.common(), name));
    filling.block("interface", filling.fill(version.interface(), name));
    filling.fill(CORE, name)
}

/// Token by which an importer knows that description and binary belong together: 128 bits of FNV-1a.
fn token(text: &str) -> String {
    /// Prime of FNV-1a with 128 bits.
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    let mut hash: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    for byte in text.bytes() {
        hash = (hash ^ u128::from(byte)).wrapping_mul(PRIME);
    }
    let digits = format!("{hash:032x}");
    format!("{{{}-{}-{}-{}-{}}}", &digits[..8], &digits[8..12], &digits[12..16], &digits[16..20], &digits[20..])
}
