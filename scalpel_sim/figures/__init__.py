"""The paper's Figures 10, 11 and 12, cut by the engine and drawn without a screen."""
