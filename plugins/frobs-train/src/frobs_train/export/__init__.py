"""Policy bundles and pretrained policies."""
