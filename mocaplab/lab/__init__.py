"""The interactive lab in parts: what it computes, sends to the browser, and draws."""
