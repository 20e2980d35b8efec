"""Cases: experiments of others, described in a TOML file, for `scalpel-sim validate --case`.

tables     the tables of a case file and what each key may hold
case_file  reads a case and checks what one table says about another
time_table values over time, by linear interpolation
assembly   the tissue, the blade and the supports of a case
recording  runs a case and records it, a row for each interval
expected   compares records with a curve or a value
report     table, plot and summary
"""
