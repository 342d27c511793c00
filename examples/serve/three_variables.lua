-- A question for wrk (docs/how-to/serve.md).
wrk.method = "POST"
wrk.headers["Content-Type"] = "application/json"
wrk.body = [[{"condition": {"coolant_flow": "8 L/min", "coolant_temperature": "20 degC",
              "ambient_temperature": "21 degC"}}]]
