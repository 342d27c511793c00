"""Checks the OpenAPI description of a service, that questions and answers are as described, and that its metrics can be read."""

import json
import sys
import urllib.error
import urllib.request

from jsonschema import Draft202012Validator
from openapi_spec_validator import OpenAPIV31SpecValidator
from prometheus_client.openmetrics.parser import text_string_to_metric_families

base = f"http://{sys.argv[1]}"


def fetch(path, body=None):
    request = urllib.request.Request(base + path, body and json.dumps(body).encode(), {"Content-Type": "application/json"})
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as refused:
        return refused.code, refused.read().decode()


described = json.loads(fetch("/openapi.json")[1])
OpenAPIV31SpecValidator(described).validate()


def holds(schema, instance):
    whole = {**schema, "components": described["components"]}
    Draft202012Validator(whole).validate(instance)


def refuses(schema, instance):
    whole = {**schema, "components": described["components"]}
    assert not Draft202012Validator(whole).is_valid(instance), instance


def parts(path, method, status):
    operation = described["paths"][path][method]
    answer = operation["responses"][str(status)]
    if "$ref" in answer:
        answer = described["components"]["responses"][answer["$ref"].rsplit("/", 1)[1]]
    asked = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema")
    return asked, answer["content"]["application/json"]["schema"]


common = {"coolant_temperature": "20 degC", "ambient_temperature [degC]": 21}
condition = {**common, "coolant_flow": "8 L/min"}
questions = [
    {"condition": condition},
    {"condition": {**condition, "coolant_flow": "800 L/min"}, "confidence": 0.9},
    {"condition": common, "free": ["coolant_flow"]},
    {"condition": {"ambient_temperature": "21 degC"}, "free": ["coolant_flow", "coolant_temperature"]},
    {"condition": {"ambient_temperature": "21 degC"}, "minimise": "coolant_flow_L_min"},
    {"indices": True},
]
seen = set()
for question in questions:
    asked, answered = parts("/surrogates/{name}/query", "post", 200)
    status, text = fetch("/surrogates/uncertain/query", question)
    assert status == 200, text
    holds(asked, question)
    holds(answered, json.loads(text))
    seen.update(json.loads(text))
assert {"free", "optimum", "trade_off", "outside", "probability", "factors"} <= seen, seen
asked, answered = parts("/surrogates/{name}/query", "post", 400)
for wrong in [{"conditions": {}}, {"condition": []}, {"confidence": 0.2}, {"free": "coolant_flow"}]:
    status, text = fetch("/surrogates/uncertain/query", wrong)
    assert status == 400, text
    refuses(asked, wrong)
    holds(answered, json.loads(text))
asked, answered = parts("/surrogates/{name}/batch", "post", 200)
batch = {"conditions": [condition, {**condition, "coolant_flow": "7 L/min"}]}
holds(asked, batch)
holds(answered, json.loads(fetch("/surrogates/uncertain/batch", batch)[1]))
chosen = {**batch, "columns": ["temperatures", "binding", "in_domain"]}
holds(asked, chosen)
holds(answered, json.loads(fetch("/surrogates/uncertain/batch", chosen)[1]))
for name in ["uncertain", "held", "bench-uncertain"]:
    holds(parts("/surrogates/{name}", "get", 200)[1], json.loads(fetch(f"/surrogates/{name}")[1]))
holds(parts("/surrogates", "get", 200)[1], json.loads(fetch("/surrogates")[1]))
holds(parts("/health", "get", 200)[1], json.loads(fetch("/health")[1]))
status, text = fetch("/surrogates/none")
holds(parts("/surrogates/{name}", "get", 404)[1], json.loads(text))

families = {family.name: family for family in text_string_to_metric_families(fetch("/metrics")[1])}
answered = {sample.labels["surrogate"]: sample.value for sample in families["coldplate_conditions"].samples if sample.name.endswith("_total")}
assert answered["uncertain"] == len(questions) + 2 * len(batch["conditions"]), answered
print("valid")
