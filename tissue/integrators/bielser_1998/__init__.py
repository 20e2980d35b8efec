"""The paper's hierarchical relaxation (section 5.2): rings of nodes around the blade."""
