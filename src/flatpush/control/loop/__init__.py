"""The loop: what is measured, what a controller is told and answers, and a simulated object to try it on."""
