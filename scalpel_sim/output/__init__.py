"""Results of a run: summary, warnings, tables, plots and exports."""
