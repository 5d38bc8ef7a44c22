"""The paper's experiment repeated: trainings, tests, tables beside the paper's, findings, and a report."""
