"""Folders of measurements as cases.

Every table, text or workbook, is read by `table_parser.py`; names and units of its columns stand in `column_names.py`,
and which column holds what is decided in `column_roles.py`. A further instrument is a file with a reader (path,
options) -> `MeasuredRows`, and its place in `instruments.py`; of another model's results one with a reader (path) ->
`ModelResult`, and its place in `finished_results.py`; transects of a boat become stations in `transects.py`. A
further layout of folders is a file that makes the keys and values of a config, and a line in
`workflow/import_folder.py`.

May import: case, effects, measurements, wording.
Open first: field_folder.py, measured_files.py, instruments.py, table_parser.py, column_names.py, result_site.py.
"""
