"""Joint, tool and wheel controllers for FRobs."""
