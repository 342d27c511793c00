//! A VTU file is read, or refused: its mesh, its fields, and a place in it.
#![no_main]

use std::path::Path;

use coldplate_base::vtu::Vtu;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(grid) = Vtu::from_bytes(bytes.to_vec(), Path::new("t.vtu")) else { return };
    for name in grid.fields() {
        let _ = grid.field(name, None);
    }
    if let (Ok(points), Ok(cells)) = (grid.coordinates(), grid.mesh()) {
        let _ = cells.place(&points, [0.1, 0.1, 0.05]);
    }
});
