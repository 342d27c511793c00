use std::process::Command;

use coldplate_export::Target;

use crate::{Terms, compare, folder, lay_out, margins, python_with};

const CONDITIONS: usize = 10_000;

/// For every model: checks it, reads conditions, writes what `margins` lists.
const DRIVER: &str = r#"
import json
import numpy as np, onnx, onnxruntime
for name in open("names").read().split():
    model = onnx.load(name + ".onnx")
    onnx.checker.check_model(model, full_check=True)
    assert [(own.domain, own.version) for own in model.opset_import] == [("", 17)], model.opset_import
    assert all(t.data_type != onnx.TensorProto.FLOAT for t in model.graph.initializer)
    facts = {entry.key: entry.value for entry in model.metadata_props}
    variables, limits = json.loads(facts["variables"]), json.loads(facts["limits"])
    session = onnxruntime.InferenceSession(name + ".onnx", providers=["CPUExecutionProvider"])
    x = np.fromfile(name + ".in").reshape(-1, len(variables))
    found = session.run(None, {"conditions": x})
    names = [own.name for own in session.get_outputs()]
    assert names == ["values", "bands", "inside"] + (["margins"] if limits else []), names
    assert found[0].shape == (len(x), len(json.loads(facts["points"]))) == found[1].shape, name
    np.hstack([own.reshape(len(x), -1).astype(float) for own in found]).tofile(name + ".out")
    # One condition alone, and none.
    assert np.allclose(session.run(["values"], {"conditions": x[:1]})[0], found[0][:1], rtol=1e-12, atol=0)
    assert session.run(["values"], {"conditions": x[:0]})[0].shape[0] == 0
"#;

#[test]
fn onnxruntime_answers_as_the_runtime_does() {
    let Some(python) = python_with("onnx, onnxruntime") else { return };
    let folder = folder("onnx");
    let names = lay_out(&folder, Target::Onnx, |_| CONDITIONS);
    let output = Command::new(python).current_dir(&folder).args(["-c", DRIVER]).output().expect("python3 starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    compare(&folder, &names, &Terms { answers: margins, order_is_own: true });
    let _ = std::fs::remove_dir_all(&folder);
}
