//! The committed header is the one that cbindgen makes from the source.

use std::fmt::Write as _;
use std::path::Path;

use actq_c::Code;
use actq_kernels::ImageError;

/// Returns C's enumeration of the codes, which a macro declares: cbindgen does not expand macros.
fn codes() -> String {
    let mut lines =
        "\n/** The status that a function returns. The numbers stay the same in all versions. */\nenum actq_code {\n"
            .to_owned();
    let own = |code: &Code| (format!("{code:?}"), *code as i32, code.text().to_str().expect("text"));
    let of_image = |error: &ImageError| (format!("Image{error:?}"), error.code().into(), error.text());
    let (first, others) = Code::ALL.split_at(2);
    let all = first.iter().map(own).chain(ImageError::ALL.iter().map(of_image)).chain(others.iter().map(own));
    for (camel, number, text) in all {
        let mut name = String::new();
        for letter in camel.chars() {
            if letter.is_uppercase() {
                name.push('_');
            }
            name.push(letter.to_ascii_uppercase());
        }
        let _ = writeln!(lines, "  /** {text} */\n  ACTQ{name} = {number},");
    }
    // Without a comma after the last one, as C90 and C++98 want it.
    lines.truncate(lines.len() - 2);
    lines + "\n};\n"
}

#[test]
fn header_is_that_of_the_source() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("capi");
    let mut config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).expect("cbindgen.toml");
    config.after_includes = Some(codes());
    let source = folder.join("src/lib.rs");
    let mut made = Vec::new();
    cbindgen::Builder::new().with_config(config).with_src(source).generate().expect("a header").write(&mut made);
    let made = String::from_utf8(made).expect("text");
    let path = folder.join("include/actq.h");
    if std::env::var_os("ACTQ_BLESS").is_some() {
        std::fs::write(&path, &made).expect("the header can be written");
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(committed == made, "include/actq.h is not up to date; ACTQ_BLESS=1 with this test writes it");
}
