"""Expected accuracy of a rig, a marker or a control field, before it is built or used."""
