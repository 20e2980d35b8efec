"""The paper's Figures 10, 11 and 12, cut by this engine and drawn without a screen."""
