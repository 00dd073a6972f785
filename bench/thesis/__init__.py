"""Tables and figures of the thesis beside ours, and where and why they differ."""
