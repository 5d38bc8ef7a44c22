"""What is shown of trainings: in Rerun, as pictures, as a page. The one room of training that reaches the viewer."""
