-- A question for wrk (docs/how-to/serve.md).
wrk.method = "POST"
wrk.headers["Content-Type"] = "application/json"
wrk.body = [[{"condition": {"coolant_flow": "9.42 L/min", "coolant_temperature": "20 degC", "motor_speed": "1800 rpm",
              "ambient_temperature": "22 degC"}}]]
