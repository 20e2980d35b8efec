"""Carries blade segments to the tissue and the wrench back. Knows neither arm nor MuJoCo."""
